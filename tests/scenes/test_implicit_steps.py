"""Semi-implicit steps: stable for any stiffness and step, with D that has h C + h² K; works that close whatever h c is."""

import numpy as np
import pytest

import pycraft as pc
from support.mechanisms import every_kind

E = pc.effects


def singles(model):
    kinds = {name: [s["kind"] for s in hinge.subhinges] for name, hinge in model.hinges.items()}
    return [name for name, of in kinds.items() if of in (["pin"], ["slider"], ["screw"])]


@pytest.mark.parametrize("step", [1e-3, 1e-2, 0.1])
@pytest.mark.parametrize("stiffness", [1e2, 1e5, 1e8, 1e11])
def test_any_stiffness_and_any_step(step, stiffness):
    """A spring alone, a damper alone and both, on every kind of hinge: the energy that is there at first is never exceeded."""
    model = every_kind()
    model.q = model.zero_q()  # springs are slack there
    v = np.zeros(model.nv)
    for name in singles(model):
        v[model.hinges[name].v_slice] = 0.1
    spring, damper = E.ImplicitSpring(stiffness), E.ImplicitDamping(stiffness)
    for effects in ([spring], [damper], [spring, damper]):
        run = pc.Scene(model).add(*effects).simulate(40 * step, model.q, v, integrator="semi-implicit-euler", step=step)
        assert np.isfinite(run.q).all() and run.energy["kinetic"].max() < 1.2 * run.energy["kinetic"][0]


def test_one_step_is_backward_euler_for_what_is_linear():
    """A slider on a spring and a damper: v⁺ = (v - h k q/m)/(1 + h c/m + h² k/m), q⁺ = q + h v⁺, digit by digit."""
    model = pc.Multibody("block")
    model.add_body("block", hinge="slider", axis=(1, 0, 0), mass=2.0)
    scene = pc.Scene(model).add(E.ImplicitSpring(3e4, rest=0.1), E.ImplicitDamping(50.0))
    run = scene.simulate(0.05, [0.3], [-0.2], integrator="semi-implicit-euler", step=0.01)
    q, v = 0.3, -0.2
    for k in range(5):
        v = (v - 0.01 * 3e4 / 2 * (q - 0.1)) / (1 + 0.01 * 50 / 2 + 1e-4 * 3e4 / 2)
        q += 0.01 * v
        assert run.q[k + 1, 0] == pytest.approx(q, rel=1e-13) and run.v[k + 1, 0] == pytest.approx(v, rel=1e-12)


@pytest.mark.parametrize("coefficient", [0.1, 10.0, 1e6])
def test_the_work_of_damping_closes_for_any_coefficient(coefficient):
    """-c v⁺(v + v⁺)/2 a second is what the step takes from the kinetic energy of a wheel, to rounding, whatever h c is."""
    model = pc.Multibody("wheel")
    model.add_body("w", mass=1.0, inertia=np.diag([0.1, 0.1, 0.2]))
    run = pc.Scene(model).add(E.ImplicitDamping(coefficient)).simulate(0.1, [0.0], [3.0], integrator="semi-implicit-euler", step=0.01)
    rounding = 4 * np.finfo(float).eps * 0.01 * coefficient * 3.0**2  # of h c v², which the work of a step is a difference of
    assert np.ptp(run.balance) < 1e-14 + rounding
    assert run.energy["work"][-1, 0] == pytest.approx(run.energy["kinetic"][-1] - 0.9, abs=1e-13 + rounding)


def test_between_steps_there_are_lines():
    """q along the group, v straight: the method's own order, 1."""
    model = pc.Multibody("block")
    model.add_body("block", hinge="slider", axis=(1, 0, 0), mass=2.0)
    run = pc.Scene(model).add(E.ImplicitSpring(1e6)).simulate(0.05, [0.3], [0.0], integrator="semi-implicit-euler", step=0.01)
    middle = run.at(0.015)
    assert middle.q[0] == pytest.approx(run.q[1:3, 0].mean(), rel=1e-12) and middle.v[0] == pytest.approx(run.v[1:3, 0].mean(), rel=1e-12)
