"""How accelerations are found and what steps by them: what does not fit is refused, both named."""

import numpy as np
import pytest

import pycraft as pc
from support.runs import CONTROLLED, FIXED, SCIPY

E = pc.effects
EXPLICIT = ["dopri5", "cash-karp54", "dop853", "bulirsch-stoer", "rk4", "rkmk4"]
BY_MOMENTA = ["variational2", "variational4"]


@pytest.mark.parametrize("integrator", [*EXPLICIT, *BY_MOMENTA, "scipy:RK45", "scipy:DOP853"])
def test_explicit_steps_and_implicit_effects(integrator):
    scene = pc.Scene(pc.chain(2)).add(E.Damping(0.1), E.ImplicitDamping(0.1), name=None)
    text = (
        f"integrator '{integrator}' finds accelerations at states, and effect 'implicit_damping' acts in steps, as h C \\+ h² K in D: "
        "take integrator 'semi-implicit-euler' or 'rosenbrock4', or an effect that acts at states"
    )
    with pytest.raises(pc.EvaluationError, match=text):
        scene.simulate(0.1, integrator=integrator, step=0.01)
    scene.disable("implicit_damping").simulate(0.1, integrator=integrator, step=0.01)
    spring = pc.Scene(pc.chain(2)).add(E.ImplicitSpring(0.1), name="stiff")
    with pytest.raises(pc.EvaluationError, match=f"'{integrator}' .* effect 'stiff'"):
        spring.simulate(0.1, integrator=integrator, step=0.01)


@pytest.mark.parametrize("integrator", ["semi-implicit-euler", "rosenbrock4", "scipy:Radau", "scipy:BDF", "scipy:LSODA"])
def test_what_solves_for_its_steps_takes_them(integrator):
    scene = pc.Scene(pc.chain(2)).add(E.ImplicitDamping(0.1), E.ImplicitSpring(3.0))
    run = scene.simulate(0.1, [0.3, 0.1], [0.0, 1.0], integrator=integrator, step=1e-4)
    plain = pc.Scene(pc.chain(2)).add(E.Damping(0.1), E.Spring(3.0)).simulate(0.1, [0.3, 0.1], [0.0, 1.0], t_eval=[0.1])
    assert np.abs(run.q[-1] - plain.q[-1]).max() < 1e-3


@pytest.mark.parametrize("integrator", BY_MOMENTA)
def test_momenta_and_prescribed_motion(integrator):
    scene = pc.Scene(pc.chain(2)).add(E.Prescribed("hinge1", 0.3), name="held")
    text = (
        f"integrator '{integrator}' steps by the momenta of all coordinates, and effect 'held' prescribes 'hinge1': take another integrator"
    )
    with pytest.raises(pc.EvaluationError, match=text):
        scene.simulate(0.1, integrator=integrator, step=0.01)


@pytest.mark.parametrize("integrator", SCIPY)
def test_precision_and_solvers_in_doubles(integrator):
    scene = pc.Scene(pc.chain(2), precision="quad")
    text = f"integrator '{integrator}' keeps states in double precision, and the scene computes in 'quad': take precision='double'"
    with pytest.raises(pc.EvaluationError, match=text):
        scene.simulate(0.1, integrator=integrator)


def test_precision_and_derivatives():
    scene = pc.Scene(pc.chain(2), precision="extended")
    with pytest.raises(pc.EvaluationError, match="integrator 'rosenbrock4' solves by derivatives .* the scene computes in 'extended'"):
        scene.simulate(0.1, integrator="rosenbrock4")


@pytest.mark.parametrize("precision", ["extended", "quad"])
@pytest.mark.parametrize("integrator", [name for name in (*CONTROLLED, *FIXED) if name != "rosenbrock4"])
def test_every_other_runs_in_every_precision(integrator, precision):
    arm = pc.tree([-1, 0], ["ball", "pin"], seed=2)
    runs = [
        pc.Scene(arm, precision=p).add(E.Gravity(), E.Spring(2.0)).simulate(0.1, integrator=integrator, step=0.02, t_eval=[0.1], rtol=1e-8)
        for p in ("double", precision)
    ]
    assert np.abs(runs[0].q - runs[1].q).max() < 1e-8 if integrator in CONTROLLED else np.abs(runs[0].q - runs[1].q).max() < 1e-14
