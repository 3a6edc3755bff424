"""Figures of models, by Matplotlib alone, and films of sweeps, pages by themselves."""

from .shares import Shares
from .stick_figure import StickFigure, plot_model
from .sweep_film import SweepFilm

__all__ = ["Shares", "StickFigure", "SweepFilm", "plot_model"]
