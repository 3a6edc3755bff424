"""What is legal but worth a word."""

import os
import sys
import warnings


class ModelWarning(UserWarning):
    """A model's numbers are legal but doubtful: a violated triangle inequality, a massless body on a hinge."""


def warn(text: str) -> None:
    """Warn at the line outside the package that led here."""
    package = os.path.dirname(os.path.dirname(__file__)) + os.sep
    level, frame = 2, sys._getframe(1)
    while frame.f_back is not None and frame.f_code.co_filename.startswith(package):
        level, frame = level + 1, frame.f_back
    warnings.warn(text, ModelWarning, stacklevel=level)
