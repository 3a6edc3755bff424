"""Rows of loops are measured by how far coordinates move them, in a watch as in a crane, and velocities that stopped are at rest."""

import numpy as np
import pytest

import pycraft as pc

EPS = np.finfo(float).eps


def four_bar(length):
    model = pc.Multibody(f"four-bar of {length:g} m")
    for i in range(3):
        where = (length if i else 0, 0, 0)
        inertia = np.diag([1e-3, 1 / 12, 1 / 12]) * length**2
        model.add_body(f"b{i}", f"b{i - 1}" if i else None, position=where, mass=1.0, com=(length / 2, 0, 0), inertia=inertia)
    model.add_loop("b2", hinge="pin", point=(length, 0, 0), name="closure")
    model.gravity = (0, -10 * length, 0)
    return model


@pytest.mark.parametrize("length", [1e-12, 1e-9, 1e-3, 1.0, 1e6, 1e12, 1e30])
def test_states_on_loops_are_found_and_others_refused(length):
    model = four_bar(length)
    sizes = model.loops.sizes([1.0, -1.0, 1 - np.pi])
    assert np.allclose(sizes[:2], 1) and (sizes[2:] > 0.99 * length).all() and (sizes[2:] <= 4 * length).all()
    for angle in np.linspace(0.4, 2.6, 12):
        found = model.assemble([angle, 0.05 - angle, angle - np.pi + 0.05], np.ones(3), fix="b0")
        # rounding of a sum of three rods, and of angles of up to π
        assert np.abs(model.loops.residual(found.q)).max() <= 32 * EPS * length
        assert np.abs(model.loops.rates(found.q, found.v)).max() <= 32 * EPS * length and found.v[0] == 1
        assert model.mobility(found.q).degrees_of_freedom == 1
    off = np.array([1.0, -0.7, 1 - np.pi])
    with pytest.raises(pc.ModelError, match="not on its loops: 'closure: along [xy]' is off by"):
        model.mobility(off)
    with pytest.raises(pc.ModelError, match="is off row 'closure: along [xy]'"):
        model.linearize(off, np.zeros(3), loops=True)
    with pytest.warns(pc.ModelWarning, match="is off row 'closure: along [xy]'"):
        pc.Scene(model).add(pc.effects.Loop()).evaluate(off, np.zeros(3))
    with pytest.raises(pc.ModelError, match="moves off row 'closure: along [xy]'"):
        model.linearize([1.0, -1.0, 1 - np.pi], [0.3, 0, 0], loops=True)
    with pytest.raises(pc.ModelError, match="no velocities .* keep its loops with 'b0', 'b1' kept"):
        model.assemble([1.0, -1.0, 1 - np.pi], [0.01, 0.01, 0], fix=["b0", "b1"])


@pytest.mark.parametrize("length", [1e-12, 1.0, 1e9])
def test_what_is_out_of_reach_is_so_at_every_scale(length):
    model = four_bar(length)
    model.loops.remove("closure")
    model.add_loop("b1", hinge="ball", point=(length, 0, 0), position=(0, 2.5 * length, 0), name="reach")
    with pytest.raises(pc.ModelError, match="loop 'reach' cannot be closed"):
        model.assemble([0.5, 0.5, 0])


@pytest.mark.parametrize("method", ["augment", "embed"])
def test_velocities_that_stopped_are_at_rest(method):
    model = four_bar(1.0)
    q = np.array([1.0, -1.0, 1 - np.pi])
    stopped = model.assemble(q, 3e5 * model.loops.jacobian(q)[2])  # all of it is across the rows
    assert not stopped.v.any()
    scene = pc.Scene(model).add(pc.effects.Loop(method=method))
    scene.simulate(0.01, q, [1e-16, 2e-16, -1e-16])  # was refused: of its own size it moves off the rows
    with pytest.raises(pc.ModelError, match="moves off"):
        scene.simulate(0.01, q, [1e-9, 2e-9, -1e-9])
    arm = pc.chain(2)
    at = arm.pose("body1", [0.4, -1.2]) @ [1, 0, 0, 1]
    arm.add_loop("body1", hinge="ball", point=(1, 0, 0), position=at[:3] - [1, 0, 0], name="latch")
    latching = pc.Scene(arm).add(pc.effects.Loop(method=method)).disable("loop")
    assert np.abs(latching.close_loops("loop", q=[0.4, -1.2], v=[1.3, -0.7]).v).max() < 1e-13


@pytest.mark.parametrize("speed", [1e-17, 3e-16, 1e-14, 0.0])
def test_what_cannot_move_has_accelerations_of_zero(speed):
    """Redundant rows of velocities that are rounding ask for different accelerations, of the square of that."""
    model = pc.Multibody("held")
    model.add_body("a", hinge="pin", axis=(0.3, 0.5, 0.8), mass=2.0, inertia=np.diag([0.3, 0.4, 0.5]))
    there = model.pose("a", [0.7])
    model.add_loop("a", hinge="pin", placement=there, point=(0, 0.2, 0.1), name="first")
    model.add_loop("a", hinge="ball", placement=there, point=(0.3, 0.2, 0.1), name="second")
    for method in ("augment", "embed"):
        assert (
            np.abs(model.constrained_dynamics([0.7], [speed], [1.0], method=method).vdot).max() < 1e-14
        )  # of the 2.5 that τ gives it alone
    assert model.linearize([0.7], [speed], loops=True).A.shape == (0, 0)


def test_a_wheel_that_lies_flat_is_assembled_from_elsewhere():
    model = pc.Multibody("wheel")
    model.add_body("wheel", hinge="free", mass=2.0, inertia=np.diag([0.1, 0.1, 0.2]))
    model.add_rolling("wheel", None, "wheel", radius=0.5, name="rolls")
    with pytest.raises(pc.EvaluationError, match="lies flat on its ground: .*; tilt it"):
        model.loops.residual(model.q)
    assert np.abs(model.loops.residual(model.assemble().q)).max() < 1e-15
    with pytest.raises(pc.EvaluationError, match="lies flat"):
        model.assemble(fix="wheel")


def test_a_curve_whose_function_fails_is_named():
    with pytest.raises(pc.ModelError, match="loop 'wire': the function of its curve fails at 0: ZeroDivisionError"):
        pc.chain(2).add_curve("body1", curve=lambda s: (1 / s, 0, 0), parameters=(0, 1), name="wire")
