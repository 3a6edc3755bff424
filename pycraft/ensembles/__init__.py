"""Ensembles: many runs of a scene, or calls of a function, over samples, on threads, processes or a Dask cluster."""

from . import samples
from .result import Failure, SweepResult
from .sweep import load_sweep, sweep

__all__ = ["Failure", "SweepResult", "load_sweep", "samples", "sweep"]
