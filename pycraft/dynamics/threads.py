"""Distribution of batches over threads: the core computes outside the GIL, each part in its own workspace.

For one state, calls of cost O(N) distribute the subtrees of a large tree; the core does that.
"""

from __future__ import annotations

import functools
import inspect
import operator
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from typing import Any, TypeVar

import numpy as np

from .. import _core

F = TypeVar("F", bound=Callable[..., Any])

_PACK = 16  # states: the largest pack of any kernel, so that every state has the same bits as with one thread
_PARTS = 4  # per thread, so that a slow one delays only a part


def over_threads(method: F) -> F:
    """Add `threads=` to a call: with more than one, the states of a batch are distributed. A single state is passed to the call itself."""
    names = [n for n, p in inspect.signature(method).parameters.items() if p.kind is p.POSITIONAL_OR_KEYWORD and n != "self"]

    @functools.wraps(method)
    def call(self: Any, *given: Any, threads: int = 1, **options: Any) -> Any:
        count = thread_count(threads)
        if count == 1:  # nothing to distribute
            return method(self, *given, **options)
        # An iterator can be consumed only once, but every thread reads the arguments.
        given = tuple(list(x) if isinstance(x, Iterator) else x for x in given)
        options = {name: list(x) if isinstance(x, Iterator) else x for name, x in options.items()}
        bound = functools.partial(method, self)
        return shared_out(bound, names, given, options, count, functools.partial(bound, *given, **options, threads=count))

    return call  # type: ignore[return-value]  # of the same signature


def thread_count(threads: Any) -> int:
    """Return the number of threads, checked; also for `Operator.at`."""
    count = 0
    if not isinstance(threads, (bool, np.bool_)):
        try:
            count = operator.index(threads)
        except TypeError:
            count = 0
    if not 1 <= count <= 1024:
        raise _core.EvaluationError(f"threads={threads!r}: the number of threads for the states of a batch, from 1 to 1024")
    return count


def shared_out(
    call: Callable[..., Any],
    names: list[str],
    given: tuple[Any, ...],
    options: dict[str, Any],
    threads: int,
    whole: Callable[[], Any] | None = None,
) -> Any:
    """Call the method on parts of the batch; for anything but a batch, and for errors, call it as a whole."""
    whole = whole or functools.partial(call, *given, **options)
    bound = {**dict(zip(names, given, strict=False)), **{n: x for n, x in options.items() if n in names}}
    rest = {n: x for n, x in options.items() if n not in names and n != "out"}
    arrays = {n: np.asarray(x) for n, x in bound.items() if isinstance(x, (np.ndarray, list, tuple)) and np.ndim(x) == 2}
    sizes = {len(a) for a in arrays.values()}
    out = options.get("out")
    if threads == 1 or "q" not in arrays or len(sizes) != 1 or len(given) > len(names):
        return whole()
    if not (out is None or (isinstance(out, np.ndarray) and out.ndim and len(out) in sizes)):
        return whole()
    (states,) = sizes
    length = max(_PACK, -(-states // (threads * _PARTS * _PACK)) * _PACK)
    if states <= length:
        return whole()
    if out is not None and any(np.shares_memory(out, a) for a in arrays.values()):
        return whole()  # parts would read results of others

    def part(start: int) -> Any:
        rows = slice(start, start + length)
        own = {n: arrays[n][rows] if n in arrays else x for n, x in bound.items()}
        return call(**own, **rest, **({} if out is None else {"out": out[rows]}))

    pool = ThreadPoolExecutor(threads)
    parts: list[Any] = []
    try:
        parts += pool.map(part, range(0, states, length))
    except Exception:  # parts number their states differently: the call as a whole raises the error
        pool.shutdown(cancel_futures=True)
        return whole()
    finally:
        pool.shutdown(wait=False, cancel_futures=True)  # an interrupt waits only for running parts
    if out is not None:
        return out
    if isinstance(parts[0], tuple):
        joined = [np.concatenate(column) for column in zip(*parts, strict=True)]
        return type(parts[0])(*joined) if hasattr(parts[0], "_fields") else tuple(joined)
    return np.concatenate(parts)
