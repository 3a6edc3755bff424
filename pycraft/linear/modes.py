"""Natural modes of a linear model: frequencies, damping, shapes, and their pictures."""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np

from .. import _core
from ..arguments import one_number, whole
from ..tidy import TidyTable
from .linear_model import LinearModel


class Modes(TidyTable):
    """The modes of a linear model, slowest first: one row per mode, one row per conjugate pair.

    Each row is a dictionary: "eigenvalue" (1/s; for a discrete model, of the continuous model that it samples), "frequency" (Hz, of the
    oscillation itself, |Im λ|/2π), "natural" (Hz, |λ|/2π), "damping" (ratio, -Re λ/|λ|; None for λ = 0), "stable" (Re λ < 0; None if Re λ
    is zero to rounding), "moves" (names of the coordinates with the largest part).

    Attributes
    ----------
    shapes : (n, modes) complex, eigenvectors, scaled to a largest displacement of one (for modes without displacements, a largest state of
        one)
    """

    columns = ("eigenvalue", "frequency", "natural", "damping", "stable", "moves")
    shown: ClassVar[dict[str, str]] = {
        "eigenvalue": "eigenvalue (1/s)", "frequency": "frequency (Hz)", "natural": "natural (Hz)", "damping": "damping ratio",
        "moves": "moves",
    }  # fmt: skip

    def __init__(self, title: str, rows: list[dict[str, Any]], shapes: np.ndarray, of: LinearModel):
        super().__init__(title, rows, {"model": of.model.name})
        self.shapes, self._of = shapes, of

    def cell(self, key: str, row: dict[str, Any]) -> str:
        if key == "eigenvalue":
            value = row[key]
            real = "0" if row["stable"] is None else f"{value.real:.4g}"
            return real + (f" ± {abs(value.imag):.4g}i" if value.imag else "")
        if key in ("frequency", "natural"):
            return f"{row[key]:.4g}" if row[key] else ""
        if key == "damping":
            return "" if row[key] is None else "0" if row["stable"] is None else f"{row[key]:.3g}"
        return ", ".join(row[key]) if key == "moves" else super().cell(key, row)

    def plot(self, mode: int, amplitude: float = 0.3, phases: int = 5, ax: Any = None) -> Any:
        """Draw the stick figure along a mode's shape, from one end of the swing to the other, the middle darkest. Returns Matplotlib axes.

        Parameters
        ----------
        mode : number of the row
        amplitude : rad or m, of the coordinate that moves most
        phases : number of figures; an odd number includes the state itself
        """
        of, count, mode = self._of, max(1, whole(phases, "phases")), whole(mode, "mode")
        if not np.isfinite(amplitude := one_number(amplitude, "amplitude")):
            raise _core.EvaluationError(f"amplitude={amplitude:g}: give the amplitude of the coordinate that moves most, rad or m")
        if not -len(self) <= mode < len(self):
            raise _core.EvaluationError(f"there is no mode {mode}; the model has {len(self)}")
        n = of.displacements
        shape = self.shapes[:n, mode] if of.tangent is None else of.tangent[: len(of.v)] @ self.shapes[:, mode]
        swing = np.real(shape * np.exp(-1j * np.angle(shape[np.abs(shape).argmax()]))) if n and np.abs(shape).max() > 0 else np.zeros(n)
        for phase in sorted(np.linspace(-1, 1, count), key=abs, reverse=True):
            q = of.model.integrate(of.q, amplitude * phase * swing)
            if of.tangent is not None:
                q = of.model.assemble(q).q
            ax = of.model.plot(q, ax, legend=False, shadow=False, alpha=1.0 - 0.75 * abs(phase))
        row = self[mode]
        ax.set_title(f"{of.model.name}, {row['natural']:.3g} Hz: {', '.join(row['moves'])}", fontsize="medium")
        return ax


def modes_of(of: LinearModel) -> Modes:
    """Return the modes of one linear model."""
    values, vectors = np.linalg.eig(of.A)
    if of.dt is not None:
        with np.errstate(divide="ignore"):
            values = np.log(values.astype(complex)) / of.dt
    kept = [i for i, value in enumerate(values) if value.imag >= 0]
    kept.sort(key=lambda i: (abs(values[i]), values[i].real))
    n = of.displacements
    rounding = 10 * len(values) * np.finfo(float).eps * (np.linalg.norm(of.A) if of.dt is None else 1 / of.dt)
    rows, shapes = [], np.zeros((len(of.states), len(kept)), complex)
    for column, i in enumerate(kept):
        vector, value = vectors[:, i], complex(values[i])
        displaced = np.abs(vector[:n])
        lead = int(displaced.argmax()) if n and displaced.max() > 1e-9 * np.abs(vector).max() else int(np.abs(vector).argmax())
        shapes[:, column] = vector / vector[lead]
        size = np.abs(shapes[:n, column]) if lead < n else np.abs(shapes[:, column])
        order = [int(k) for k in np.argsort(-size, kind="stable")[:3] if size[k] > 0.2]
        names = [of.states[k].removeprefix("q.") if lead < n else of.states[k] for k in order]
        rows.append(
            {
                "eigenvalue": value,
                "frequency": abs(value.imag) / (2 * np.pi),
                "natural": abs(value) / (2 * np.pi),
                "damping": -value.real / abs(value) if value else None,
                "stable": None if abs(value.real) <= rounding else value.real < 0,
                "moves": names,
            }  # fmt: skip
        )
    return Modes(f"Modes of {of.model.name}", rows, shapes, of)
