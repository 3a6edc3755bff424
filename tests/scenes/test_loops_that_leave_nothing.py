"""Scenes on loops where nothing is left to move, or too much is asked: all hinges locked, loops that are open there, prescribed motion."""

import numpy as np
import pytest

import pycraft as pc

E = pc.effects
by_each_method = pytest.mark.parametrize("method", ["augment", "embed"])
SQUARE = [np.pi / 2, -np.pi / 2, -np.pi / 2]


def square(**loop):
    model = pc.chain(3)
    model.add_loop("body2", hinge="pin", point=(1, 0, 0), name="closure", **loop)
    model.q = SQUARE
    return model


def kept(model, method, *others):
    return pc.Scene(model).add(E.Gravity((1, -9, 0)), *others, E.Loop(method=method))


@by_each_method
def test_a_closed_linkage_whose_hinges_are_all_locked_stands_still(method):
    model = square()
    model.lock(list(model.hinges))
    assert model.nv == 0
    run = kept(model, method).simulate(0.1, progress=False)
    assert run.t[-1] == 0.1 and run.drift["closure"].max() < 1e-15


@by_each_method
@pytest.mark.parametrize("locked", [["hinge0", "hinge1"], ["hinge0", "hinge1", "hinge2"]])
def test_a_loop_that_no_coordinate_moves_is_seen_to_be_open(method, locked):
    """Between locked hinges no row has an entry; what it is off by is so many metres."""
    model = pc.chain(3)
    model.add_loop("body1", hinge="ball", point=(1, 0, 0), position=(0.3, 0.5, 0), name="closure")
    model.q = SQUARE
    model.lock(locked)
    with pytest.raises(pc.ModelError, match=r"the state given is off row 'closure: along x' by 0\.3: .*assemble"):
        kept(model, method).simulate(0.1, progress=False)


@by_each_method
@pytest.mark.parametrize("begins", [lambda t: t**3, lambda t: np.sin(t) ** 3, lambda t: 0.1 * t**4])
def test_motions_of_values_alone_begin_at_rest(begins, method):
    """Their rates at rest are differences, 1e-13 instead of zero: a state that does not move keeps the loops all the same."""
    run = kept(square(), method, E.Prescribed("hinge0", lambda t: np.pi / 2 + begins(t))).simulate(0.3, progress=False)
    crank = np.pi / 2 + begins(0.3)
    assert np.abs(run.q[-1] - [crank, -crank, crank - np.pi]).max() < 1e-14


@by_each_method
def test_a_start_that_moves_off_the_loops_slowly_is_refused_too(method):
    """By 1e-3 rad/s, a thousand times what differences leave."""
    model = square()
    for speed in (1e-3, 1.0):
        with pytest.raises(pc.ModelError, match="moves off row 'closure: along"):
            kept(model, method).simulate(0.1, model.q, [speed, 0, 0], progress=False)
        turning = E.Prescribed("hinge0", lambda t, speed=speed: np.pi / 2 + speed * t)
        with pytest.raises(pc.ModelError, match="with 'hinge0' as prescribed, moves off row 'closure: along"):
            kept(model, method, turning).simulate(0.1, model.q, [0, speed, 0], progress=False)


@by_each_method
def test_a_prescribed_coordinate_that_the_loop_determines_is_named(method):
    """Crank and rod of a rhombus turn as one: what is asked differently is refused at the start, and later with its time."""
    at_once = [E.Prescribed(f"hinge{i}", lambda t, i=i: SQUARE[i] + (-2) ** i * t * t) for i in (0, 1)]
    later = [E.Prescribed(f"hinge{i}", lambda t, i=i: SQUARE[i] + (-2) ** i * t**3) for i in (0, 1)]
    for motions, when in ((at_once, "0"), (later, r"0\.\d+")):
        with pytest.raises(pc.EvaluationError, match=rf"'closure: along.*, with 'hinge0', 'hinge1' as prescribed, at t = {when} s$"):
            kept(square(), method, *motions).simulate(0.5, progress=False)


@by_each_method
def test_a_prescribed_coordinate_that_the_loop_does_not_follow_is_named(method):
    """Ground pins are 2.5 m apart: the crank turns up to where the others are stretched, and no further."""
    model = pc.chain(3)
    model.add_loop("body2", hinge="pin", point=(1, 0, 0), position=(1.5, 0, 0), name="closure")
    model.q = model.assemble([0.5, -0.5, -0.5], fix="hinge0").q
    crank = model.q[0]
    v0 = model.assemble(model.q, [0.5, 0, 0], fix="hinge0").v
    scene = kept(model, method, E.Prescribed("hinge0", lambda t: crank + 0.5 * t))
    stretched = (np.arccos((2.5**2 + 1 - 2**2) / (2 * 2.5)) - 0.5) / 0.5
    with pytest.raises(pc.EvaluationError, match=r"step size fell to .* at t = 0\.726424 s.*the motion is singular"):
        scene.simulate(3.0, model.q, v0, progress=False)  # velocities grow as 1/√(the way to it)
    assert abs(stretched - 0.726424) < 1e-6
    with pytest.raises(pc.EvaluationError, match=r"left its loops.*'closure: along.*, with 'hinge0' as prescribed, at t = 0\.7\d* s$"):
        scene.simulate(3.0, model.q, v0, integrator="rk4", step=0.01, progress=False)
