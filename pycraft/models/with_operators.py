"""A model with its spatial operators, created on first use and again after a change of structure."""

from __future__ import annotations

from .. import _core
from ..operators.operator_set import OperatorSet
from . import warning


class WithOperators(_core.Multibody):
    """The core's model with its operators, and warnings before they are used."""

    _soa: OperatorSet | None = None

    @property
    def soa(self) -> OperatorSet:
        """The spatial operators of this model: `soa.phi`, `soa.H`, ..., or several at once: `phi, H, M = soa("phi H M")`."""
        if self._soa is None or not self._soa.is_current():
            self.warn()
            self._soa = OperatorSet(_core.operators_of(self), self)
        return self._soa

    def _say(self, text: str) -> None:
        """Issue a warning at the line outside the package."""
        warning.warn(text)

    def warn(self) -> None:
        """Warn, once, of legal but doubtful data: violated triangle inequalities, massless bodies on hinges."""
        for _, words in self.take_warnings():
            warning.warn(words)
