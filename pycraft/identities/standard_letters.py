"""Vectors and matrices of the equations of motion that have letters in the book, by the operators that make them.

They are written in the letters of the operator table and in each other, in the grammar's spelling. A letter with several meanings has the
one whose spaces fit, the first of them where several do: C is the vector of Coriolis and gyroscopic forces, or the matrix of which C θ̇ is
that vector (the Christoffel matrix; so ℳ̇ - 2C is skew).
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class StandardLetter:
    """A letter: how it is shown, its name in words, and its meanings, one or several."""

    text: str
    meaning: str
    meanings: tuple[str, ...]


_RATE = "(phi^*(Delta_theta_dot^* phi_tilde^* H^* + H_dot^*))"
_CHRISTOFFEL = f"H phi (M {_RATE} + (1/2)(momentum_cross + V_bar M + M V_tilde) phi^* H^*) + C_J"
_CORIOLIS = "H phi (M phi^* a + b) + b_J"

STANDARD = {
    "T": StandardLetter("T", "hinge forces", ("H f + J vdot + b_J",)),
    "alpha": StandardLetter("α", "body accelerations", ("phi^*(H^* vdot + a)",)),
    "f": StandardLetter("f", "interbody forces", ("phi(M alpha + b)",)),
    "C": StandardLetter("C", "Coriolis and gyroscopic hinge forces, or the Coriolis matrix", (_CORIOLIS, _CHRISTOFFEL)),
    "C_force": StandardLetter("𝒞", "Coriolis and gyroscopic hinge forces", (_CORIOLIS, _CHRISTOFFEL)),
    "z": StandardLetter("z", "residual forces of the articulated-body algorithm", ("psi(K (T - b_J) + P a + b)",)),
    "epsilon": StandardLetter("ε", "innovations forces", ("T - b_J - H z",)),
    "nu": StandardLetter("ν", "innovations accelerations", ("D^-1 epsilon",)),
    "xi": StandardLetter("ξ", "innovations velocities", ("(I + H phi K)^* theta_dot",)),
    "p": StandardLetter("p", "momenta of all bodies outboard", ("phi M velocity",)),
    "m": StandardLetter("m", "factor of the mass matrix", ("(I + H phi K) D^½",)),
    "eta": StandardLetter("η", "normalized velocities", ("m^* theta_dot",)),
    "alpha_plus": StandardLetter("α⁺", "accelerations carried from the parent", ("E^* alpha",)),
    "V_plus": StandardLetter("V⁺", "velocities carried from the parent", ("E^* velocity",)),
    "z_plus": StandardLetter("z⁺", "residual forces on the inboard side", ("z + G epsilon",)),
}
"""By the names that the grammar of statements has for them."""
GUARDED = {f"{name}{rate}" for name in STANDARD for rate in ("", "_dot") if len(name) > 1 and not name.startswith(("C_", "V_", "z_"))}
"""Words that are letters only where no other letter stands before them: zeta holds no eta."""
