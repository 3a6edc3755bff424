"""Figures of models, by Matplotlib alone."""

from .stick_figure import StickFigure, plot_model

__all__ = ["StickFigure", "plot_model"]
