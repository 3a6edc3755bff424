"""Singular states on motions of linkages, against where closed forms have them; batches of assemblies.

Tolerance of places: a state on the loops beside a singular one is off by the root of its residuals' rounding at most, 1.5e-8 rad, here a
few of them over a sample's width of some hundredths: 1e-5 of a sample.
"""

import numpy as np
import pytest

import pycraft as pc
from pycraft.models.assembly import Assembler
from support.planar_linkages import four_bar, four_bar_angles, off, slider_crank

PLACE = 1e-5


def followed(lengths, angles, branch):
    """A four-bar's states at these crank angles, by the closed form."""
    return np.array([[angle, *four_bar_angles(lengths, angle)[branch]] for angle in angles])


def test_a_rhombus_is_flat_where_its_crank_is_along_the_ground():
    model, crank = four_bar(1.0, 1.0, 1.0, 1.0), np.linspace(-3.5, 7, 60)
    along = model.mobility_along(np.column_stack([crank, -crank, crank - np.pi]))
    assert along.generic_rank == 2 and np.array_equal(along.degrees_of_freedom, np.ones(60))
    places = (np.array([-np.pi, 0.0, np.pi, 2 * np.pi]) - crank[0]) / (crank[1] - crank[0])
    assert np.abs([one.at for one in along.singular_states] - places).max() < PLACE
    for one in along.singular_states:
        assert list(one.lost) == ["closure: along x"] and one.distance < 1e-7
        assert model.mobility(one.q, tolerance=1e-7).singular


@pytest.mark.parametrize("count", [7, 40])
def test_a_change_point_linkage_is_flat_once_a_turn(count):
    """The shortest and the longest bar are as long as the others together: flat where the crank is along the ground, and nowhere else."""
    lengths = (0.4, 1.0, 0.8, 1.2)  # 0.4 + 1.2 < 1.0 + 0.8: it never is; the one below is
    angles = np.linspace(-1.0, 2 * np.pi - 1.5, count)
    assert not four_bar(*lengths).mobility_along(followed(lengths, angles, 0)).singular_states
    lengths = (0.6, 1.0, 0.8, 1.2)  # 0.6 + 1.2 = 1.0 + 0.8: bars overlap at π
    found = four_bar(*lengths).mobility_along(followed(lengths, angles, 0)).singular_states
    assert len(found) == 1 and np.abs(found[0].q - [np.pi, -np.pi, 0]).max() < 1e-6  # places: on a bent way
    assert angles[int(found[0].at)] < np.pi < angles[int(found[0].at) + 1]


def test_a_slider_crank_with_equal_bars_may_fold_where_its_piston_passes_the_crank():
    model, theta = slider_crank(1.0, 1.0), np.linspace(0.3, 2.9, 11)
    along = model.mobility_along(np.column_stack([theta, -2 * theta, 2 * np.cos(theta)]))
    assert len(along.singular_states) == 1
    one = along.singular_states[0]
    assert theta[int(one.at)] < np.pi / 2 < theta[int(one.at) + 1] and np.abs(one.q - [np.pi / 2, -np.pi, 0]).max() < 1e-6
    assert "singular at sample 4.88" in str(along) and along.distance.min() > 0.01


def test_a_singular_sample_is_found_once_and_angles_may_be_wound():
    model, crank = four_bar(1.0, 1.0, 1.0, 1.0), np.linspace(-0.5, 0.5, 11)
    q = np.column_stack([crank, -crank, crank - np.pi])
    q[6:, 2] += 2 * np.pi
    found = model.mobility_along(q).singular_states
    assert [one.at for one in found] == [5.0]
    q[::2, 0] += 2 * np.pi
    assert [round(one.at, 4) for one in model.mobility_along(q[[0, 1, 2, 3, 4, 6, 7]]).singular_states] == [4.5]


def test_models_without_rows_and_motions_of_none():
    free = pc.chain(2).mobility_along(np.zeros((3, 2)))
    assert free.generic_rank == 0 and free.degrees_of_freedom.tolist() == [2, 2, 2] and np.isinf(free.distance).all()
    none = four_bar(1.0, 1.0, 1.0, 1.0).mobility_along(np.zeros((0, 3)))
    assert not none.singular_states and str(none) == "generic rank 0, no samples"


@pytest.mark.parametrize("count", [1, 3])
def test_a_motion_that_is_singular_everywhere(count):
    along = four_bar(1.0, 1.0, 1.0, 1.0).mobility_along([[0.0, 0.0, -np.pi]] * count)
    (one,) = along.singular_states
    assert one.at == 0 and list(one.lost) == ["closure: along x"] and along.rank.tolist() == [1] * count and along.generic_rank == 2


@pytest.mark.parametrize(
    ("q", "said"),
    [
        ([0.0, 0.0, np.pi], r"samples \(B, 3\), not an array \(3,\)"),
        ([[0.0, 0.0, np.pi], [0.5, 0.0, 0.0]], "not on its loops at sample 1: 'closure: "),
        ([[0.0, 0.0, np.nan]], "q of hinge 'rocker': entry 0 is nan"),
        (np.zeros((2, 4)), "takes 3 numbers"),
        ("abc", "not an array of numbers"),
    ],
)
def test_refused(q, said):
    with pytest.raises(pc.ModelError, match=said):
        four_bar(1.0, 1.0, 1.0, 1.0).mobility_along(q)


def test_tolerance_of_the_search_is_one_of_singular_values():
    with pytest.raises(pc.ModelError, match="tolerance must be between 0 and 1"):
        four_bar(1.0, 1.0, 1.0, 1.0).mobility_along([[0.0, 0.0, np.pi]], tolerance=2.0)


def test_samples_without_a_way_on_the_loops_are_told():
    """Two states of r = (1 - x²)((x² - a)² + b), between which |r| has least values b(1 - a) that are no zeros."""
    model, a, b = pc.Multibody("valley"), 0.0557, 0.01
    model.add_body("cart", hinge="slider", mass=1.0)
    r = np.polymul([-1, 0, 1], np.polymul([1, 0, -a], [1, 0, -a]) + [0, 0, 0, 0, b])
    model.add_coupling({"cart": r[::-1]}, name="apart")
    with pytest.raises(pc.ModelError, match="between samples 0 and 1 no state of 'valley' on its loops was found"):
        model.mobility_along([[1.0], [-1.0]])


def test_a_distance_that_is_the_same_everywhere_is_not_searched(monkeypatch):
    gears = pc.chain(2)
    gears.add_coupling({"hinge0": 1.0, "hinge1": -3.0})
    asked = []
    monkeypatch.setattr(Assembler, "solve", lambda self, q, solve=Assembler.solve: (asked.append(q), solve(self, q))[1])
    turns = np.linspace(0, 10, 5)
    assert not gears.mobility_along(np.column_stack([3 * turns, turns])).singular_states and len(asked) <= 10


def test_batches_of_assemblies_are_their_states():
    lengths = (0.4, 1.0, 0.8, 1.0)
    model, angles = four_bar(*lengths), np.linspace(0, 2 * np.pi, 9)
    start = np.column_stack([angles, np.full(9, 0.8), np.full(9, -2.0)])
    states = model.assemble(start, np.eye(9, 3), fix="crank")
    assert states.q.shape == states.v.shape == (9, 3) and np.array_equal(states.q[:, 0], angles)
    for i, q in enumerate(states.q):
        assert min(off(q[1:], exact) for exact in four_bar_angles(lengths, angles[i])) < 1e-12
        assert np.array_equal(model.assemble(start[i], np.eye(9, 3)[i], fix="crank").v, states.v[i])
    assert model.assemble(start[0], np.eye(9, 3), fix="crank").q.shape == (9, 3)
    assert model.assemble(np.zeros((0, 3))).q.shape == (0, 3)


@pytest.mark.parametrize("count", [0, 2])
def test_what_is_no_coordinate_is_told_of_no_state(count):
    with pytest.raises(pc.ModelError, match="^no hinge or coordinate of 'four-bar' is called 'piston'"):
        four_bar(1.0, 1.0, 1.0, 1.0).assemble(np.zeros((count, 3)), fix="piston")
    with pytest.raises(pc.ModelError, match="^tolerance must be a positive number"):
        four_bar(1.0, 1.0, 1.0, 1.0).assemble(np.zeros((count, 3)), tolerance=-1)


def test_the_state_of_a_batch_that_cannot_be_assembled_is_told():
    with pytest.raises(pc.ModelError, match=r"state 1 of 2: 'four-bar' cannot be assembled with 'crank' kept, from 3 starts"):
        four_bar(1.0, 0.2, 0.2, 1.0).assemble([[0.1, 1.5, 1.5], [3.0, 0, 0]], fix="crank", starts=3)
