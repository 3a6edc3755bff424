"""What walks an expression in Python recurses, and says so where the expression is nested too deeply for that."""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Any, TypeVar

from .. import _core

_Call = TypeVar("_Call", bound=Callable[..., Any])


def within_reach(what: str) -> Callable[[_Call], _Call]:
    """A decorator: EvaluationError that names `what` where the interpreter's limit of recursion is reached."""

    def decorated(call: _Call) -> _Call:
        @functools.wraps(call)
        def guarded(*args: Any, **kwargs: Any) -> Any:
            try:
                return call(*args, **kwargs)
            except RecursionError:
                raise _core.EvaluationError(
                    f"{what}: the expression is nested too deeply (some hundred levels); take its parts one by one"
                ) from None

        return guarded  # type: ignore[return-value]  # as the call that it wraps

    return decorated
