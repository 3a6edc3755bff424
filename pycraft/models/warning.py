"""What is legal but worth a word."""

import warnings


class ModelWarning(UserWarning):
    """A model's numbers are legal but doubtful: a violated triangle inequality, a massless body on a hinge."""


def warn(text: str) -> None:
    """Warn at the caller's line outside the package."""
    warnings.warn(text, ModelWarning, stacklevel=3)
