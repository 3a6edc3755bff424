"""Equations of motion derived for a four-bar alone: by SymPy, printed as C++, built like compiled calls.

The only unknowns are the angles of the three bars from +x in Lagrange's equations: energies in closed form, with the two equations that
close the loop, solved by elimination. Programs for general mechanisms are measured against its cost.
"""

from __future__ import annotations

import ctypes
from typing import Any

import numpy as np
import sympy
from sympy.printing.cxx import cxx_code_printers

from ..compiled.build import built
from ..compiled.source import FUNCTION


def equations(gravity: float = 9.81) -> tuple[list[tuple[Any, Any]], list[Any]]:
    """Return the assignments, in order, and q̈ of the coordinates of `n_four_bar(1)` in terms of them: q, v and tau are `q0`, `v0`, `tau0`,
    ...

    Bars of 1 m and 1 kg with their centres in their middles; gravity in m/s² along -y.
    """
    time = sympy.Symbol("t")
    angles = [sympy.Function(f"a{i}")(time) for i in range(3)]  # absolute angles of the crank, the coupler, the other crank
    tips = [sympy.Matrix([sympy.cos(a), sympy.sin(a)]) for a in angles]
    ground = sympy.Matrix([1, 0])
    centres = [tips[0] / 2, tips[0] + tips[1] / 2, ground + tips[2] / 2]
    turns = [a.diff(time) for a in angles]
    kinetic = sum((c.diff(time).dot(c.diff(time)) / 2 + w**2 / 24 for c, w in zip(centres, turns, strict=True)), sympy.S.Zero)
    potential = sum((gravity * c[1] for c in centres), sympy.S.Zero)
    closure = tips[0] + tips[1] - ground - tips[2]
    # The remaining functions of angles in Lagrange's equations: sines and cosines of the inputs, each computed once.
    sines, cosines = sympy.symbols("s0:3"), sympy.symbols("c0:3")
    speeds = sympy.symbols("w0:3")
    plain = {
        **dict(zip([a.diff(time) for a in angles], speeds, strict=True)),
        **dict(zip([sympy.sin(a) for a in angles], sines, strict=True)),
        **dict(zip([sympy.cos(a) for a in angles], cosines, strict=True)),
    }

    def without_time(x: Any) -> Any:
        return sympy.expand_trig(sympy.sympify(x)).subs(plain)

    twice = [a.diff(time, 2) for a in angles]
    motion = [sympy.expand(kinetic.diff(w).diff(time) - kinetic.diff(a) + potential.diff(a)) for a, w in zip(angles, turns, strict=True)]
    closing = [sympy.expand(row) for row in closure.diff(time, 2)]
    mass = sympy.Matrix(3, 3, lambda i, j: without_time(sympy.simplify(motion[i].coeff(twice[j]))))
    rows = sympy.Matrix(2, 3, lambda i, j: without_time(closing[i].coeff(twice[j])))
    rest = dict.fromkeys(twice, sympy.S.Zero)
    bias = sympy.Matrix([without_time(m.subs(rest)) for m in motion])
    curving = sympy.Matrix([without_time(c.subs(rest)) for c in closing])
    # tau works on q = (a0, a1 - a0, a2)
    q, v, tau = (sympy.symbols(f"{name}0:3") for name in ("q", "v", "tau"))
    force = sympy.Matrix([tau[0] - tau[1], tau[1], tau[2]]) - bias
    held: list[tuple[Any, Any]] = [(speeds[0], v[0]), (speeds[1], v[0] + v[1]), (speeds[2], v[2])]
    for i, angle in enumerate((q[0], q[0] + q[1], q[2])):
        held += [(sines[i], sympy.sin(angle)), (cosines[i], sympy.cos(angle))]

    def named(matrix: Any, letter: str) -> Any:
        """Return symbols for the entries that are not constants."""
        out = matrix.copy()
        for i in range(matrix.rows):
            for j in range(matrix.cols):
                twin = next((symbol for symbol, value in held if value == matrix[i, j]), None)
                if matrix[i, j].free_symbols:
                    out[i, j] = twin or sympy.Symbol(f"{letter}{i}{j}")
                    if twin is None:
                        held.append((out[i, j], matrix[i, j]))
        return out

    mass, rows, force, curving = named(mass, "m"), named(rows, "r"), named(force, "f"), named(curving, "k")
    # q̈ = M⁻¹ (f + R* λ), R q̈ + k = 0: M has a 2 × 2 block and a 1 × 1 block, R M⁻¹ R* is 2 × 2.
    inverse = named(mass.inv(method="ADJ").applyfunc(sympy.together), "i")
    moved, free = named(inverse * rows.T, "b"), named(inverse * force, "u")
    compliance, off = named(rows * moved, "s_"), named(rows * free + curving, "e")
    multipliers = named(-compliance.inv(method="ADJ") * off, "l")
    turning = free + moved * multipliers
    return held, [turning[0], turning[1] - turning[0], turning[2]]


def source(gravity: float = 9.81) -> str:
    """Return their C++: a function in the form of a compiled call, for one state (pycraft/compiled/runtime/loop.h)."""
    held, results = equations(gravity)
    names = [symbol for symbol, _ in held]
    common, reduced = sympy.cse([value for _, value in held] + results, symbols=sympy.numbered_symbols("x"), optimizations="basic")
    code = cxx_code_printers["c++17"]().doprint
    # A common subexpression is placed as soon as all its parts are known.
    lines, known, waiting = list[str](), set(names) - set(names), list(common)

    def put_common() -> None:
        while True:
            ready = next(((s, e) for s, e in waiting if not (e.free_symbols & late) - known), None)
            if ready is None:
                return
            waiting.remove(ready)
            known.add(ready[0])
            lines.append(f"const double {ready[0]} = {code(ready[1])};")

    late = set(names) | {s for s, _ in common}
    for symbol, value in zip(names, reduced[: len(names)], strict=True):
        put_common()
        lines.append(f"const double {symbol} = {code(value)};")
        known.add(symbol)
    put_common()
    read = [f"const double {name}{i} = given[{k}][{i}];" for k, name in enumerate(("q", "v", "tau")) for i in range(3)]
    write = [f"out[{i}] = {code(value)};" for i, value in enumerate(reduced[len(names) :])]
    body = "\n".join("  " + line for line in [*read, *lines, *write, "return 0;"])
    head = f'extern "C" std::int64_t {FUNCTION}(const double* const* given, const std::int64_t*, double* out, std::int64_t) {{'
    return f"// A four-bar of equal bars, by SymPy {sympy.__version__}.\n#include <cmath>\n#include <cstdint>\n\n{head}\n{body}\n}}\n"


def accelerations(place: str, q: np.ndarray, v: np.ndarray, tau: np.ndarray) -> np.ndarray:
    """Return q̈ (B, 3) from this library, at states (B, 3)."""
    function = getattr(ctypes.CDLL(place), FUNCTION)
    pointer = ctypes.POINTER(ctypes.c_double)
    function.argtypes = (ctypes.POINTER(pointer), ctypes.c_void_p, pointer, ctypes.c_int64)
    out = np.empty_like(q)
    for one, *state in zip(out, q, v, tau, strict=True):
        function((pointer * 3)(*(np.ascontiguousarray(x).ctypes.data_as(pointer) for x in state)), None, one.ctypes.data_as(pointer), 1)
    return out


def library(gravity: float = 9.81) -> str:
    """Return the path of the library built from the source."""
    return str(built(source(gravity)))
