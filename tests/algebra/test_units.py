"""Units do not matter to what is eliminated over the tree."""

import numpy as np
import pytest

import pycraft as pc
from campaigns import units
from campaigns.units import UNITS
from pycraft.accuracy.hard_cases import cases_elimination


@pytest.mark.parametrize("first", [0, *(pytest.param(n, marks=pytest.mark.slow) for n in range(100, 300, 50))])
def test_powers_of_two_change_no_bit(first):
    count = 6 if first == 0 else 50
    wrong = [(seed, *line) for seed in range(first, first + count) for line in units.differing_bits(seed)]
    assert not wrong, wrong[:5]


@pytest.mark.parametrize("first", [0, pytest.param(100, marks=pytest.mark.slow)])
def test_powers_of_two_change_no_bit_of_a_motion(first):
    """Direct calls in the fast form, any powers of two of mass, length and time: no square root of what has a unit is taken."""
    count = 8 if first == 0 else 100
    wrong = [(seed, *line) for seed in range(first, first + count) for line in units.differing_bits_in_motion(seed)]
    assert not wrong, wrong[:5]


@pytest.mark.parametrize("name", UNITS)
@pytest.mark.parametrize("first", [0, pytest.param(100, marks=pytest.mark.slow)])
def test_answers_are_right_in_any_units(name, first):
    for seed in range(first, first + (4 if first == 0 else 50)):
        errors = units.worst_errors(seed, name)
        assert max(errors.values()) <= 1, (seed, errors)


@pytest.mark.parametrize("case", cases_elimination.cases(), ids=lambda case: case.name)
def test_hard_cases(case):
    errors = case.measure(range(3), 0)
    assert set(errors) == set(cases_elimination.REQUESTS)
    assert max(float(np.max(e)) for e in errors.values()) <= 1e-12, errors


@pytest.mark.parametrize("unit", [(1e-9, 1e-4), (1e3, 1e3), (3e-26, 1e-10)], ids=["grain", "kilometre", "molecule"])
def test_statements_are_checked_in_any_units(unit):
    """A pair of bodies whose scaled condition is small: the theorem holds, by its own route and by elimination."""
    mass, length = unit
    pair = pc.Multibody("pair")
    for k in range(2):
        pair.add_body(
            f"body{k}",
            "body0" if k else None,
            axis=(1, 2, 3) if k else (0, 0, 1),
            position=(length, 0, 0),
            mass=mass,
            com=(0.3 * length, 0.1 * length, 0),
            inertia=mass * length**2 * np.diag([0.1, 0.2, 0.25]),
        )
    pair.q = (0.3, 0.4)
    H, phi, M, psi, K, D, I = pair.soa("H phi M psi K D I")
    MM = H @ phi @ M @ phi.T @ H.T
    S = I - H @ psi @ K
    dense = np.asarray(MM.dense())
    x = pc.vector("x", pair.soa.Theta)
    for column in np.eye(2):
        assert np.abs((MM.inv() @ x).value(rules=False, x=dense @ column) - column).max() <= 1e-13
    assert pc.check("inv(H phi M phi* H*) == (I - H psi K)* inv(D) (I - H psi K)", pair)
    assert np.allclose((S.T @ D.inv() @ S).dense() @ dense, np.eye(2), atol=1e-13)


def test_a_singular_operator_is_refused_in_any_units():
    """Two pins about one axis on a massless body between them: D of the inner one is rounding, whatever its size."""
    for mass, length in UNITS.values():
        model = pc.Multibody("coaxial")
        axis = np.array([1.0, 2.0, 3.0])
        model.add_body("inner", None, axis=axis, position=(length, 0, 0))
        model.add_body("outer", "inner", axis=axis, position=(0, 0, 0), mass=mass, com=(0.3 * length, 0.1 * length, 0.2 * length))
        model.bodies["outer"].inertia = mass * length**2 * np.diag([0.1, 0.2, 0.25])
        model.take_warnings()
        model.q = (0.3, 0.4)
        H, phi, M = model.soa("H phi M")
        MM = H @ phi @ M @ phi.T @ H.T
        with pytest.raises(pc.SingularOperatorError):
            (MM.inv() @ pc.vector("x", model.soa.Theta)).value(rules=False, x=np.ones(2))
        with pytest.raises(ArithmeticError):
            MM.logdet().value()
