"""Roots of block-diagonal operators that are symmetric by theorems, one side spelt otherwise."""

import numpy as np
import pytest

import pycraft as pc


def congruences(soa):
    """Block-diagonal congruences with one side, or both, spelt otherwise: name -> (as typed, as a congruence)."""
    H, phi, M, D, psi, P, E, G = soa("H phi M D psi P E G")
    return {
        "E P (I - φ⁻¹)*": (E @ P @ (soa.I - phi.inv()).T, E @ P @ E.T),
        "(I - φ⁻¹) P E*": ((soa.I - phi.inv()) @ P @ E.T, E @ P @ E.T),
        "P H* G*": (P @ H.T @ G.T, G @ D @ G.T),
        "ψ⁻¹ ψ M φ* φ⁻*": (psi.inv() @ psi @ M @ phi.T @ phi.inv().T, M),
        "H ψ M ψ* H*": (H @ psi @ M @ psi.T @ H.T, D),
        "4 H ψ M (I - E_ψ*)⁻¹ H*": (4 * H @ psi @ M @ (soa.I - soa.E_psi.T).inv() @ H.T, 4 * D),
    }


@pytest.mark.parametrize("name", congruences(pc.chain(2).soa))
def test_roots_of_congruences_with_one_side_rewritten(name):
    """X Y* has a root where X = Y* by the theorems; its square is what was typed."""
    model = pc.tree([-1, 0, 1, 1, 0], ["pin", "ball", "pin", "slider", "universal"], seed=3)
    model.q = model.random_state(0).q
    typed, congruence = congruences(model.soa)[name]
    root = typed.sqrt()
    assert root.text() != congruence.sqrt().text()  # nothing that was typed is rewritten
    for rules in (True, False):
        found = root.dense(rules=rules)
        scale = np.abs(congruence.dense()).max()
        assert np.abs(found @ found.T - congruence.dense()).max() <= 1e-12 * scale
        assert np.abs(found - congruence.sqrt().dense()).max() <= 1e-6 * np.sqrt(scale)  # half of the digits where singular


def test_roots_of_what_is_no_congruence_are_refused():
    model = pc.tree([-1, 0, 1, 1, 0], seed=3)
    H, phi, M, P, tau, psi = model.soa("H phi M P tau psi")
    wrong = [H @ phi @ M @ phi.T @ H.T, tau @ M, psi @ M @ phi.T, H @ phi @ M @ psi.T @ H.T]
    model.hinges["hinge1"].rotor_inertia = [0.3]
    wrong.append(H @ psi @ M @ psi.T @ H.T)  # with rotors it is not D
    for op in wrong:
        with pytest.raises(pc.SpaceError, match="symmetric block-diagonal"):
            pytest.fail(op.sqrt().text())
