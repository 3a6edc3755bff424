"""Numbers, signs and divisors in the book's reading, against the same formula typed in Python: by value, not by shape."""

import numpy as np
import pytest

import pycraft as pc

TEXTS = {
    "φ/2": lambda o: o.phi / 2,
    "HφK/4": lambda o: o.H @ o.phi @ o.K / 4,
    "φ/2 - φ/8": lambda o: o.phi * (1 / 2 - 1 / 8),
    "3φ/2": lambda o: 1.5 * o.phi,
    "½φ + ¼ψ": lambda o: 0.5 * o.phi + 0.25 * o.psi,
    "3/2 φ": lambda o: 1.5 * o.phi,
    "-φ + ψ": lambda o: o.psi - o.phi,
    "-2φ + 3ψ": lambda o: 3 * o.psi - 2 * o.phi,
    "φ - 2ψ + 3E_φ": lambda o: o.phi - 2 * o.psi + 3 * o.E,
    "φ - ψ + E_ψ - E_φ": lambda o: o.phi - o.psi + o.E_psi - o.E,
    "φ - ψ - E_φ + I": lambda o: o.phi - o.psi - o.E + pc.identity(o.F),
    "2(φ - 3ψ)/5": lambda o: (o.phi - 3 * o.psi) * 0.4,
    "-(φ - ψ)*": lambda o: (o.psi - o.phi).T,
    "(HφK)* - 2K*φ*H*": lambda o: -1 * (o.K.T @ o.phi.T @ o.H.T),
    "φMψ* - φ*": None,
    "ψφ - 2ψE_ψ/3 + φ": lambda o: o.psi @ o.phi - (2 / 3) * (o.psi @ o.E_psi) + o.phi,
    "D⁻¹ - 2D⁻¹/3": lambda o: o.D.inv() / 3,
    "(2D)⁻¹": lambda o: o.D.inv() / 2,
    "H φ G - 0.5 D - D/4": lambda o: o.H @ o.phi @ o.G - 0.75 * o.D,
}


@pytest.fixture(scope="module")
def soa():
    return pc.tree([-1, 0, 1, 0], ["pin", "universal", "ball", "slider"], seed=3).soa


@pytest.mark.parametrize("text", [t for t, made in TEXTS.items() if made])
def test_value_of_a_text(text, soa):
    got, expected = pc.parse(text, soa).dense(), TEXTS[text](soa).dense()
    assert np.abs(got - expected).max() <= 1e-13 * np.abs(expected).max(), text


@pytest.mark.parametrize("text", [t for t, made in TEXTS.items() if not made])
def test_what_does_not_fit_is_refused(text, soa):
    with pytest.raises(pc.Error):
        pc.parse(text, soa)
