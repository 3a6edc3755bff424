"""Theorems that tie what the sweep makes together, from the values of each form of the articulated-inertia sweep.

Bounds as in test_forms.
"""

import mpmath
import numpy as np
import pytest

from support.descriptions import KINDS, body, model, random_inertia, subhinge
from support.forms import FORMS, epsilon, largest
from support.formulas import EPS, SLACK, letters_of, norm
from support.mechanisms import SEQUENCES, build, every_kind, with_hinges

DIGITS = 60
each_form = pytest.mark.parametrize("form", FORMS)
each_hinge = pytest.mark.parametrize("kind", [*KINDS, *SEQUENCES])
rotors = pytest.mark.parametrize("rotor_inertia", [False, True], ids=["no rotors", "rotors"])


@each_form
@rotors
@pytest.mark.parametrize("precision", ["double", pytest.param("quad", marks=pytest.mark.slow)])
def test_identities(precision, rotor_inertia, form):
    """Theorems that tie what the sweep makes together, from the values of each form, none of them used to make them."""
    models = {"double": [every_kind(rotor_inertia)], "quad": [with_hinges("free", "tree", rotor_inertia)]}
    for multibody in (*models[precision], with_hinges("custom", "forest", rotor_inertia)):
        letters, kept = letters_of(multibody), float if precision == "double" else object
        with mpmath.workdps(DIGITS):
            E, phi, H, M, J, P, P_plus, D, G, K, tau_bar, E_psi, psi, Upsilon, Omega = (
                getattr(multibody.soa, name).at(multibody.q, form=form, precision=precision).dense(dtype=kept)
                for name in "E phi H M J P P_plus D G K tau_bar E_psi psi Upsilon Omega".split()
            )
            I, one, scale = np.eye(len(P)), np.eye(len(D)), epsilon(precision) / EPS
            o = letters.o
            sides = {
                "P = M + blockdiag(E_φP⁺E_φ*)": (P, M + blocks(o, E @ P_plus @ E.T), letters.P),
                "M = P - E_ψPE_φ*": (M, P - E_psi @ P @ E.T, letters.P),
                "M = P - E_ψPE_ψ* - KJK*": (M, P - E_psi @ P @ E_psi.T - K @ J @ K.T, letters.P),
                "D = HPH* + J": (D, H @ P @ H.T + J, letters.H @ letters.P @ letters.H.T),
                "GD = PH*": (G @ D, P @ H.T, letters.P @ letters.H.T),
                "P⁺ = τ̄P": (P_plus, tau_bar @ P, letters.tau_bar @ letters.P),
                "P⁺ = τ̄Pτ̄* + GJG*": (P_plus, tau_bar @ P @ tau_bar.T + G @ J @ G.T, letters.tau_bar @ letters.P @ letters.tau_bar.T),
                "K = E_φG": (K, E @ G, letters.E @ letters.G),
                "τ̄ = I - GH": (tau_bar, I - G @ H, letters.G @ letters.H),
                "E_ψ = E_φτ̄": (E_psi, E @ tau_bar, letters.E @ letters.tau_bar),
                "(I - E_ψ)ψ = I": ((I - E_psi) @ psi, I, letters.psi @ letters.E_psi + letters.psi),
                "Υ = blockdiag(Ω)": (Upsilon, blocks(o, Omega), letters.Omega),
                "[I + HφK][I - HψK] = I": ((one + H @ phi @ K) @ (one - H @ psi @ K), one,
                                           letters.H @ letters.phi @ letters.K @ letters.H @ letters.psi @ letters.K),
            }  # fmt: skip
        for name, (left, right, size) in sides.items():
            off, bound = largest(left - right), (size.bound + letters.P.bound * (1 + norm(o.E)) ** 2) * scale
            assert off <= bound, f"{name}: off by {off:.2e}, bound {bound:.2e}"
            assert bound < 1e-5 * largest(left), f"{name}: a bound of {bound:.1e} for sides of {largest(left):.1e} says nothing"
        assert np.array_equal(P, P.T) and np.array_equal(P_plus, P_plus.T) and np.array_equal(D, D.T)  # symmetric by construction


def blocks(o, X):
    """The diagonal blocks of X: F → F, body by body."""
    kept = 0 * X
    for s in o.states:
        kept[s, s] = X[s, s]
    return kept


@each_form
@pytest.mark.parametrize("precision", ["double", *(pytest.param(p, marks=pytest.mark.slow) for p in ("extended", "quad"))])
@each_hinge
def test_annihilation(kind, precision, form):
    """P⁺H* = 0 where J = 0: what P has along the hinge is gone, to the rounding of P itself."""
    multibody = with_hinges(kind, "tree")
    letters = letters_of(multibody)
    at = dict(form=form, precision=precision)
    with mpmath.workdps(DIGITS):
        P_plus, H = (getattr(multibody.soa, n).at(multibody.q, **at).dense(dtype=object if precision != "double" else float)
                     for n in ("P_plus", "H"))  # fmt: skip
        left = largest(P_plus @ H.T)
    bound = SLACK * letters.error("P_plus", letters.o.P_plus) * norm(letters.o.H) * epsilon(precision) / EPS
    assert left <= bound, f"P⁺H* has {left:.2e}, bound {bound:.2e}"


@each_form
def test_annihilation_along_a_coordinate_axis_is_exact(form):
    """On pins and sliders along the axes of their bodies the row and the column of P⁺ are zero, not small."""
    steps = [subhinge("pin", [0, 0, 1]), subhinge("slider", [0, 1, 0]), subhinge("pin", [-1, 0, 0]), subhinge("pin", [0, 1, 0])]
    rng = np.random.default_rng(2)
    made = [body(f"b{k}", k - 1, [s], 2.0, rng.normal(size=3), random_inertia(rng, 2.0), rng.normal(size=3)) for k, s in enumerate(steps)]
    multibody = build(model(made), 1)
    P_plus, H = (getattr(multibody.soa, name).at(multibody.q, form=form).dense() for name in ("P_plus", "H"))
    assert np.count_nonzero(H) == 4 and not (P_plus @ H.T).any()
