"""Walks through an expression in Python are recursive, and raise a clear error if it is nested too deeply."""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Any, TypeVar

from .. import _core

_Call = TypeVar("_Call", bound=Callable[..., Any])


def within_reach(what: str) -> Callable[[_Call], _Call]:
    """Return a decorator that raises EvaluationError with the name `what` at the interpreter's recursion limit."""

    def decorated(call: _Call) -> _Call:
        @functools.wraps(call)
        def guarded(*args: Any, **kwargs: Any) -> Any:
            try:
                return call(*args, **kwargs)
            except RecursionError:
                raise _core.EvaluationError(
                    f"{what}: the expression is nested too deeply (some hundred levels); treat its parts one by one"
                ) from None

        return guarded  # type: ignore[return-value]  # the type of the wrapped call

    return decorated
