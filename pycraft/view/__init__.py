"""Figures of models, by Matplotlib alone, and films of sweeps, pages by themselves."""

from .stick_figure import StickFigure, plot_model
from .sweep_film import SweepFilm

__all__ = ["StickFigure", "SweepFilm", "plot_model"]
