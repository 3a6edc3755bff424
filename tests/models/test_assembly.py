"""States on loops against closed forms: four-bars, slider-cranks, wheels; mobility of linkages whose rows are redundant or become so.

Tolerances: a refined state leaves residuals of some roundings of lengths near one, 20 eps; coordinates are off by that through the
conditioning of the loop, at the states below under a hundred.
"""

import re

import numpy as np
import pytest

import pycraft as pc
from support.planar_linkages import four_bar, four_bar_angles, off, slider_crank

EPS = float(np.finfo(float).eps)
CLOSE = 5000 * EPS


@pytest.mark.parametrize("seed", range(25))
def test_four_bars_from_far_off(seed):
    """Any four lengths, any crank angle, from any start: found where the closed form has it, refused where it has not."""
    rng = np.random.default_rng(seed)
    lengths, angle = rng.uniform(0.3, 1.5, 4), rng.uniform(-np.pi, np.pi)
    model, exact = four_bar(*lengths), four_bar_angles(lengths, angle)
    q0 = [angle, *rng.uniform(-np.pi, np.pi, 2)]
    if not exact:
        with pytest.raises(
            pc.ModelError, match=r"'four-bar' cannot be assembled with 'crank' kept, from 20 starts: loop 'closure' cannot be closed"
        ):
            model.assemble(q0, fix="crank")
        return
    state = model.assemble(q0, [1.0, 0, 0], fix="crank")
    assert state.q[0] == angle and state.v[0] == 1.0
    assert np.abs(model.loops.residual(state)).max() < 20 * EPS and np.abs(model.loops.jacobian(state) @ state.v).max() < CLOSE
    assert min(off(state.q[1:], e) for e in exact) < CLOSE
    h = 1e-5  # central differences of the closed form: h² of its third derivative
    branch = int(np.argmin([off(state.q[1:], e) for e in exact]))
    ahead, behind = (four_bar_angles(lengths, angle + s) for s in (h, -h))
    if ahead and behind:
        rate = (np.array(ahead[branch]) - behind[branch]) / (2 * h)
        assert np.abs(rate - state.v[1:]).max() < 1e-6 * (1 + np.abs(rate).max() ** 3)


def test_both_branches_and_no_more():
    lengths, angle = (0.4, 1.0, 0.8, 1.0), 0.7
    states = four_bar(*lengths).assembly_branches([angle, 0.1, 0.1], fix="crank")
    exact = four_bar_angles(lengths, angle)
    assert len(states) == 2
    assert sorted(min(range(2), key=lambda k: off(s.q[1:], exact[k])) for s in states) == [0, 1]
    for state in states:
        assert min(off(state.q[1:], e) for e in exact) < CLOSE and np.abs(state.q[1:]).max() < 2 * np.pi
    assert np.linalg.norm(states[0].q - [angle, 0.1, 0.1]) <= np.linalg.norm(states[1].q - [angle, 0.1, 0.1])


def test_a_continuum_of_branches_is_refused():
    with pytest.raises(
        pc.ModelError, match="leave 1 degree of freedom, and a continuum of states: fix as many .*'crank', 'coupler', 'rocker'"
    ):
        four_bar(0.4, 1.0, 0.8, 1.0).assembly_branches([0.7, 0.1, 0.1])


@pytest.mark.parametrize("theta", np.linspace(-3, 3, 7))
def test_slider_crank(theta):
    """x = r cos θ + √(l² - r² sin² θ), and ẋ by its derivative."""
    r, rod = 0.4, 1.0
    model = slider_crank(r, rod)
    state = model.assemble([theta, -theta, r + rod], [2.0, 0, 0], fix=["crank"])
    root = np.sqrt(rod**2 - (r * np.sin(theta)) ** 2)
    assert abs(state.q[2] - (r * np.cos(theta) + root)) < CLOSE
    assert abs(state.v[2] - 2 * (-r * np.sin(theta) - r**2 * np.sin(theta) * np.cos(theta) / root)) < CLOSE


def test_what_is_near_is_found_and_what_is_around_no_loop_stays():
    model = four_bar(0.4, 1.0, 0.8, 1.0)
    model.add_body("bystander", "crank", "ball", mass=1.0)
    exact = [0.7, *four_bar_angles((0.4, 1.0, 0.8, 1.0), 0.7)[1]]
    rest = list(np.array([0.1, 0.2, 0.3, 0.4]))
    order = [model.hinges[name].q_slice.start for name in ("crank", "coupler", "rocker")]
    q0 = model.zero_q()
    q0[order], q0[model.hinges["bystander"].q_slice] = np.add(exact, [0.0, 0.01, -0.02]), rest
    before = np.array(model.q)
    state = model.assemble(q0)
    assert np.abs(state.q[order] - exact).max() < 0.05 and np.abs(model.loops.residual(state)).max() < 20 * EPS
    turned = state.q[model.hinges["bystander"].q_slice]
    assert np.abs(turned - rest).max() < 4 * EPS  # not moved, up to the rounding of a product
    assert np.array_equal(model.q, before)
    again = model.assemble(state)
    assert np.abs(again.q - state.q).max() < 4 * EPS


def test_spatial_loops_of_free_bodies():
    """A platform on three legs of two balls each, from a random start: every leg's length and joint is kept."""
    model, rng = pc.Multibody("tripod"), np.random.default_rng(1)
    model.add_body("platform", hinge="free", mass=1.0, inertia=np.eye(3))
    for k in range(3):
        c, s = np.cos(2 * np.pi * k / 3), np.sin(2 * np.pi * k / 3)
        model.add_body(f"leg{k}", hinge="ball", position=(c, s, 0), mass=1.0, inertia=np.eye(3))
        corner = model.add_node(f"corner{k}", "platform", position=(c / 2, s / 2, 0))
        model.add_loop(corner, f"leg{k}", "ball", position=(0, 0, 1.5), name=f"joint{k}")
    state = model.assemble(model.random_state(rng), np.ones(model.nv))
    assert np.abs(model.loops.residual(state)).max() < 40 * EPS
    assert np.abs(model.loops.jacobian(state) @ state.v).max() < CLOSE
    for k in range(3):
        foot, corner = np.array([np.cos(2 * np.pi * k / 3), np.sin(2 * np.pi * k / 3), 0]), model.frame(f"corner{k}").pose(state.q)[:3, 3]
        assert np.linalg.norm(corner - foot) == pytest.approx(1.5, abs=100 * EPS)
    assert model.mobility(state).degrees_of_freedom == 6 + 9 - 9


def test_couplings_are_assembled_and_keep_their_winding():
    model = pc.chain(2)
    model.add_coupling({"hinge0": 1.0, "hinge1": -3.0}, constant=0.5, name="gear")
    state = model.assemble([20.0, 0.0], [1.0, 0.0], fix="hinge0")
    assert state.q.tolist() == pytest.approx([20.0, 20.5 / 3]) and state.v.tolist() == pytest.approx([1.0, 1 / 3])
    assert [s.q.tolist() for s in model.assembly_branches([20.0, 0.0], fix="hinge0")] == [pytest.approx([20.0, 20.5 / 3])]


def test_turns_that_a_coupling_tells_apart_are_branches():
    """r = q² - 2πq is zero at 0 and at 2π, which are one pose and two states."""
    model = pc.chain(2)
    model.add_coupling({"hinge1": [0.0, -2 * np.pi, 1.0]}, name="cam")
    found = [state.q[1] for state in model.assembly_branches([0.3, 2.5], fix="hinge0")]
    assert found == pytest.approx([0, 2 * np.pi], abs=CLOSE)


def test_velocities_keep_rows_of_velocities():
    model = pc.Multibody("skate")
    model.add_body("skate", hinge="planar", mass=1.0, inertia=np.eye(3))
    model.add_node("blade", "skate", rotation=[[1, 0, 0], [0, 0, -1], [0, 1, 0]])
    model.add_rolling("blade", kind="blade", name="edge")
    state = model.assemble([1.0, 2.0, np.pi / 2], [3.0, 4.0, 5.0])
    assert state.q.tolist() == [1.0, 2.0, np.pi / 2]
    assert np.abs(state.v - [0.0, 4.0, 5.0]).max() < CLOSE  # turned to +y, it moves along y alone


# ------------------------------------------------------------------ none there


def test_loops_that_conflict_are_named():
    model = pc.chain(2)
    model.add_loop("body1", hinge="ball", point=(1, 0, 0), position=(0.0, 0, 0), name="here")
    model.add_loop("body1", hinge="ball", point=(1, 0, 0), position=(0.5, 0, 0), name="there")
    with pytest.raises(
        pc.ModelError,
        match=r"each can be closed by itself, but loop 'here', loop 'there' not together.*0\.25 of '(here|there): along x', 0\.25 of",
    ):
        model.assemble([0.3, 0.4])
    model.add_loop("body0", hinge="ball", position=(0, 0, 2), name="off the plane")
    with pytest.raises(
        pc.ModelError, match=r"loop 'off the plane' cannot be closed even alone.*these remain: 2 of 'off the plane: along z'"
    ):
        model.assemble([0.3, 0.4], starts=2)


def test_velocities_that_conflict_are_named():
    model = four_bar(0.4, 1.0, 0.8, 1.0)
    q = model.assemble([0.7, 0.1, 0.1]).q
    with pytest.raises(
        pc.ModelError,
        match=r"no velocities of 'four-bar' keep its loops with 'crank', 'coupler', 'rocker' kept: these remain: .*'closure: along",
    ):
        model.assemble(q, [1.0, 0.0, 0.0], fix=["crank", "coupler", "rocker"], tolerance=1e-9)


@pytest.mark.parametrize(
    ("given", "said"),
    [
        (dict(q0=[0.0]), r"q of 'four-bar'"),
        (dict(fix="piston"), r"no hinge or coordinate of 'four-bar' is called 'piston'"),
        (dict(fix={"crank": 0.4}), r"named by a list, without values, which are those of a state: \['crank'\], not \{'crank': 0.4\}"),
        (dict(starts=0), r"starts must be at least 1 \(the number of starting states\), not 0"),
        (dict(starts=1.5), r"starts must be a whole number"),
        (dict(tolerance=0), r"tolerance must be a positive number, not 0"),
        (dict(tolerance=np.nan), r"tolerance must be a positive number"),
        (dict(tolerance=np.inf), r"tolerance must be a positive number, not inf"),
        (dict(seed="x"), r"seed must be a whole number"),
    ],
)
def test_arguments_that_are_none(given, said):
    model = four_bar(0.4, 1.0, 0.8, 1.0)
    with pytest.raises(pc.ModelError, match=said):
        model.assemble(**given)


@pytest.mark.parametrize("far", [1e160, 1e308])
def test_what_is_beyond_all_reach_is_said_in_metres(far):
    """Squares of such residuals are no doubles."""
    model = pc.chain(3)
    model.add_loop("body2", hinge="ball", position=(far, 0, 0), name="away")
    with pytest.raises(
        pc.ModelError, match=rf"loop 'away' cannot be closed even alone.*remain: .*{re.escape(f'{far:g}')} of 'away: along x'"
    ):
        model.assemble([0.1, 0.2, 0.3], starts=3)


def test_branches_are_of_one_state():
    with pytest.raises(pc.ModelError, match=r"assembly starts from one state, not from an array \(2, 3\)"):
        four_bar(0.4, 1.0, 0.8, 1.0).assembly_branches(np.zeros((2, 3)), fix="crank")


def test_part_of_a_rotation_is_not_kept():
    model = pc.Multibody("ball")
    model.add_body("ball", hinge="ball", mass=1.0)
    model.add_loop("ball", hinge="weld", name="weld")
    with pytest.raises(
        pc.ModelError, match="hinge 'ball' has a rotation, and its coordinates cannot be fixed one by one; fix the hinge: 'ball'"
    ):
        model.assemble(fix=[0])
    assert model.assemble([0.5, 0.5, 0.5, -0.5]).q[0] != 0.5


def test_no_loops_and_no_coordinates():
    model = pc.chain(2)
    assert model.assemble([0.1, 0.2], [1.0, 2.0]).v.tolist() == [1, 2]
    assert model.mobility([0.1, 0.2]).degrees_of_freedom == 2 and model.mobility([0.1, 0.2]).distance == np.inf
    fixed = pc.Multibody("fixed", welds="keep")
    fixed.add_body("block", hinge="weld", mass=1.0)
    fixed.add_loop("block", hinge="pin", name="pin")
    assert fixed.assemble().q.shape == (0,) and fixed.mobility().degrees_of_freedom == 0 and len(fixed.mobility().redundant) == 5


# ------------------------------------------------------------------ mobility


def bricard():
    """Six pins, each across the next, on six edges of a cube; one of the edges is the ground."""
    model, edges = pc.Multibody("bricard"), [(1, 0, 0), (0, -1, 0), (0, 0, 1), (-1, 0, 0), (0, 1, 0), (0, 0, -1)]
    parent, at = None, (0, 0, 0)
    for k in range(5):
        model.add_body(f"bar{k}", parent, position=at, axis=np.cross(edges[k - 1], edges[k]), mass=1.0, inertia=np.eye(3))
        parent, at = f"bar{k}", edges[k]
    model.add_loop("bar4", hinge="pin", axis=np.cross(edges[4], edges[5]), point=at, position=np.subtract((0, 0, 1), at), name="last")
    return model


def test_bricard_moves_though_a_row_too_many_is_there_everywhere():
    model = bricard()
    q, along = np.zeros(5), np.zeros(5)
    for step in range(4):
        found = model.mobility(q)
        assert (found.degrees_of_freedom, found.rank, found.generic_rank, found.singular) == (1, 4, 4, False)
        assert len(found.redundant) == 1
        along = found.freedoms[:, 0] * (1 if found.freedoms[:, 0] @ along >= 0 else -1)
        q = model.assemble(model.integrate(q, 0.3 * along)).q
        assert np.abs(q).max() > 0.1 * (step + 1)


def test_redundant_rows_are_combinations_of_the_others():
    model = bricard()
    found = model.mobility(model.assemble([0.2, 0, 0, 0, 0]))
    q = model.assemble([0.2, 0, 0, 0, 0]).q
    Q = dict(zip(model.loops.rows, model.loops.jacobian(q), strict=True))
    for row, terms in found.dependencies.items():
        assert np.abs(Q[row] - sum(c * Q[name] for name, c in terms.items())).max() < 1e-7  # the tolerance of rank
    assert list(found.dependencies) == found.redundant and f"redundant: {found.redundant[0]!r} = " in str(found)
    assert np.abs(model.loops.jacobian(q) @ found.freedoms).max() < 1e-7


def test_planar_rows_that_ask_nothing_are_named():
    found = four_bar(0.4, 1.0, 0.8, 1.0).mobility(four_bar(0.4, 1.0, 0.8, 1.0).assemble([0.7, 0.1, 0.1]))
    assert found.redundant == ["closure: about x", "closure: about y", "closure: along z"] and not found.dependencies
    assert found.degrees_of_freedom == 1 and not found.singular and "which asks nothing here" in str(found)


def test_the_flat_parallelogram_is_singular_and_seen_from_afar():
    model = four_bar(1.0, 2.0, 1.0, 2.0)
    flat = model.mobility([0.0, 0.0, -np.pi])
    assert flat.singular and (flat.rank, flat.generic_rank, flat.degrees_of_freedom) == (1, 2, 2)
    assert set(flat.lost) == {"closure: along x"} and flat.lost["closure: along x"] == pytest.approx(1, abs=0.05)
    assert "singular: rank 2 at neighbouring states" in str(flat)
    distances = [model.mobility([t, -t, t - np.pi]).distance for t in (0.8, 0.4, 0.2, 0.1, 0.05)]
    assert all(x > y for x, y in zip(distances, distances[1:], strict=False))
    assert distances[-2] / distances[-1] == pytest.approx(2, abs=0.05)  # it goes to zero like the angle


def test_redundant_loops_of_couplings():
    model = pc.chain(3)
    for a, b in ((0, 1), (1, 2), (0, 2)):
        model.add_coupling({a: 1.0, b: -1.0}, name=f"{a}{b}")
    found = model.mobility([0.3, 0.3, 0.3])
    assert found.degrees_of_freedom == 1 and len(found.redundant) == 1
    signs = {"01": 1.0, "12": 1.0, "02": -1.0}
    ((row, terms),) = found.dependencies.items()
    assert {name: round(c, 12) for name, c in terms.items()} == {name: -signs[name] / signs[row] for name in signs if name != row}


def test_rank_does_not_hang_on_the_units_of_rows():
    model = pc.chain(2)
    model.add_coupling({0: 1e-12, 1: -1e-12}, name="small")
    found = model.mobility([0.3, 0.3])
    assert (found.rank, found.redundant) == (1, []) and found.distance == pytest.approx(1)


def test_mobility_off_the_loops_is_refused():
    model = four_bar(0.4, 1.0, 0.8, 1.0)
    with pytest.raises(
        pc.ModelError, match=r"'four-bar' is not on its loops: 'closure: along x' is off by 1\.2; mobility needs a state on the loops"
    ):
        model.mobility([0.0, 0.0, 0.0])
    with pytest.raises(pc.ModelError, match=r"mobility takes one state, not an array \(2, 3\)"):
        model.mobility(np.zeros((2, 3)))


@pytest.mark.parametrize("call", ["assemble", "assembly_branches"])
def test_velocities_that_are_no_numbers(call):
    arm = pc.chain(3)
    arm.add_node("tip", "body2", position=(1, 0, 0))
    arm.add_loop("tip", None, "pin", axis=(0, 0, 1), position=(2, 0, 0))
    with pytest.raises(pc.ModelError, match="v of hinge 'hinge1': entry 0 is nan"):
        getattr(arm, call)([0.5, -0.8, 0.4], [0, np.nan, 0], fix=["hinge0"])


@pytest.mark.parametrize("tolerance", [np.nan, -1.0, 0.0, 1.0])
def test_the_tolerance_of_mobility(tolerance):
    with pytest.raises(pc.ModelError, match="tolerance must be between 0 and 1"):
        pc.chain(2).mobility(tolerance=tolerance)
