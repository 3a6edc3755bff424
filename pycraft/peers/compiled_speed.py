"""Code compiled for one model beside the ordinary call and other packages' calls: a table of `pycraft bench --peers`."""

from __future__ import annotations

import os
import tempfile
import time
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from .. import _core
from .clock import Time, elapsed, in_turn

CALLS = ("forward_dynamics", "inverse_dynamics", "mass_matrix", "mass_matrix_inverse")
LARGEST = 20
"""Largest number of coordinates of compiled models: beyond, straight-line code gains little over loops."""


@dataclass
class CompiledRow:
    """One call compiled for one model: seconds to build it, its time in C++ and from Python, the call's own in C++, Pinocchio's in C++."""

    model: str
    nv: int
    call: str
    operations: int
    built: float
    kernel: Time
    python: Time
    ordinary: Time
    peer_kernel: Time | None

    @property
    def ratio(self) -> float | None:
        """Pinocchio's time in C++ over the compiled call's."""
        return None if self.peer_kernel is None else self.peer_kernel.median / self.kernel.median

    def as_json(self) -> dict[str, Any]:
        """Return plain data."""
        times = {name: getattr(self, name)._asdict() for name in ("kernel", "python", "ordinary")}
        return {**asdict(self), **times, "peer_kernel": self.peer_kernel and self.peer_kernel._asdict(), "ratio": self.ratio}


def compiled_row(name: str, model: Any, call: str, states: tuple[np.ndarray, ...], peer: Time | None, seconds: float) -> CompiledRow:
    """Compile it anew, check it against the call to rounding, then time it in turn with the call. EvaluationError if they differ."""
    before = os.environ.get("PYCRAFT_CACHE")
    with tempfile.TemporaryDirectory() as folder:
        os.environ["PYCRAFT_CACHE"] = str(Path(folder))
        try:
            begin = time.perf_counter()
            compiled = model.compile(call)
            built = time.perf_counter() - begin
        finally:
            if before is None:
                del os.environ["PYCRAFT_CACHE"]
            else:
                os.environ["PYCRAFT_CACHE"] = before
        given = states[: len(compiled.arguments)]
        one = tuple(x[0].copy() for x in given)
        found, wanted = compiled(*one), getattr(model, call)(*one)
        error = float(np.abs(found - wanted).max() / np.abs(wanted).max())
        if not error < 1e-9:
            raise _core.EvaluationError(f"{call} of {name} compiled is not the call's in the run that times it: off by {error:.1e}")
        out = np.empty_like(found)
        library = str(compiled.library), "pycraft_run", list(given), found.size
        kernel, python, ordinary = in_turn(
            seconds,
            partial(_core.time_compiled, *library),
            partial(elapsed, lambda: compiled(*one, out=out)),
            partial(_core.time_dynamics, model, call, *states),
        )
    return CompiledRow(name, model.nv, call, compiled.operations, built, kernel, python, ordinary, peer)
