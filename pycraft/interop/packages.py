"""Packages that only one extra needs: imported when they are asked for, missed by name."""

from __future__ import annotations

from importlib import import_module
from typing import Any

from .. import _core


class MissingPackageError(_core.Error, ImportError):
    """A package that only one extra needs is not installed."""


def required(package: str, extra: str, what: str) -> Any:
    """The module of a package; MissingPackageError, saying what needs it and which extra brings it, where it is not installed."""
    try:
        return import_module(package)
    except ImportError:
        text = f"{what} the package {package}, which is not installed: pip install 'pycraft-soa[{extra}]'"
        raise MissingPackageError(text) from None
