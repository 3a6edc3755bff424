"""Figures of models, which need only Matplotlib, and films of sweeps, which are self-contained pages."""

from .shares import Shares
from .stick_figure import StickFigure, plot_model
from .sweep_film import SweepFilm

__all__ = ["Shares", "StickFigure", "SweepFilm", "plot_model"]
