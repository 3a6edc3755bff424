"""Warnings about legal but doubtful models."""

import os
import sys
import warnings


class ModelWarning(UserWarning):
    """A model is legal but doubtful: a violated triangle inequality, a massless body on a hinge."""


def warn(text: str) -> None:
    """Warn at the calling line outside the package."""
    package = os.path.dirname(os.path.dirname(__file__)) + os.sep
    level, frame = 2, sys._getframe(1)
    while frame.f_back is not None and frame.f_code.co_filename.startswith(package):
        level, frame = level + 1, frame.f_back
    warnings.warn(text, ModelWarning, stacklevel=level)
