"""Packages of the extras: imported on first use, with an error that names the extra."""

from __future__ import annotations

from importlib import import_module
from typing import Any

from .. import _core


class MissingPackageError(_core.Error, ImportError):
    """A package of an extra is not installed."""


def required(package: str, extra: str, what: str) -> Any:
    """Return the module of a package; MissingPackageError, with the feature that needs it and the extra, if it is not installed."""
    try:
        return import_module(package)
    except ImportError:
        text = f"{what} the package {package}, which is not installed: pip install 'pycraft-soa[{extra}]'"
        raise MissingPackageError(text) from None
