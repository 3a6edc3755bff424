"""A model with its spatial operators, made when they are first asked for and again when its structure has changed."""

from __future__ import annotations

from .. import _core
from ..operators.operator_set import OperatorSet
from . import warning


class WithOperators(_core.Multibody):
    """The core's model with its operators, and what is worth a word before they are used."""

    _soa: OperatorSet | None = None

    @property
    def soa(self) -> OperatorSet:
        """The spatial operators of this model: `soa.phi`, `soa.H`, ..., or several at once: `phi, H, M = soa("phi H M")`."""
        if self._soa is None or not self._soa.is_current():
            self.warn()
            self._soa = OperatorSet(_core.operators_of(self), self)
        return self._soa

    def _say(self, text: str) -> None:
        """Warn, at the line outside the package."""
        warning.warn(text)

    def warn(self) -> None:
        """Say, once, what is legal but worth a word: violated triangle inequalities, massless bodies on hinges."""
        for _, words in self.take_warnings():
            warning.warn(words)
