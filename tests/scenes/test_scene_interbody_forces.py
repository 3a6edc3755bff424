"""Forces of hinges under effects: in scenes and along runs, against the model under the same wrenches, and closed forms."""

import pickle

import numpy as np
import pytest

import pycraft as pc
from support.mechanisms import every_kind

E = pc.effects


def close(a, b, tolerance=1e-11):
    assert a.shape == np.shape(b)
    assert np.abs(a - b).max(initial=0) <= tolerance * (1 + np.abs(b).max(initial=0))


def pushed_model():
    """A model whose gravity and wrenches are those of its scene."""
    model = every_kind(rotor_inertia=True)
    model.gravity = (0.3, -1.0, -9.8)
    last = list(model.bodies)[-1]
    scene = pc.Scene(model).add(
        E.Gravity(g=(0.3, -1.0, -9.8)), E.Damping(0.1), E.Wrench(last, (1, 2, 3, 4, 5, 6)), E.Wrench(last, (0, 1, 0, 2, 0, 0), axes="body")
    )
    R = model.pose(last, model.q)[:3, :3]
    return model, scene, {last: np.r_[R @ (0, 1, 0) + (1, 2, 3), R @ (2, 0, 0) + (4, 5, 6)]}


@pytest.mark.parametrize("axes", ["body", "aligned", "world", "body3"])
def test_of_a_scene(axes):
    model, scene, wrenches = pushed_model()
    expected = model.interbody_forces(tau=-0.1 * model.v, wrenches=wrenches, axes=axes)
    close(scene.interbody_forces(axes=axes), expected)
    close(scene.interbody_forces(list(model.hinges)[4], axes=axes), expected[4])
    reaction = model.interbody_forces(tau=-0.1 * model.v, wrenches=wrenches, axes=axes, part="reaction")
    close(scene.interbody_forces(axes=axes, part="reaction"), reaction)


def test_precisions_and_rest():
    model, scene, _ = pushed_model()
    wide = pc.Scene(model, precision="quad").add(*scene.effects.values())
    close(scene.interbody_forces(), wide.interbody_forces())
    at_rest = pc.Scene(model).add(*scene.effects.values())
    close(scene.interbody_forces(q=model.q), at_rest.interbody_forces(None, model.q, np.zeros(model.nv)))


def test_along_a_run():
    model, scene, _ = pushed_model()
    run = scene.simulate(0.2, t_eval=np.linspace(0, 0.2, 5))
    hinge = list(model.hinges)[2]
    f = run.interbody_forces(hinge, axes="world")
    assert f.shape == (5, 6)
    for i in range(5):
        close(f[i], scene.interbody_forces(hinge, run.q[i], run.v[i], run.t[i], axes="world"))
    at = run.at(0.07)
    close(at.interbody_forces(), scene.interbody_forces(None, at.q, at.v, 0.07))
    with pytest.raises(pc.EvaluationError, match="this motion has no scene"):
        pickle.loads(pickle.dumps(run)).interbody_forces()
    model.bodies["body1"].mass = 2.0
    with pytest.raises(pc.StaleOperatorError):
        run.interbody_forces()


def test_prescribed_motion_takes_what_it_needs():
    model = pc.chain(2)
    scene = pc.Scene(model).add(E.Gravity(g=(0, -10, 0)), E.Prescribed("hinge0", E.Harmonic(0.0, 1.0)))
    found = scene.evaluate([0, 0.4], [0, 0.0])
    f = scene.interbody_forces(None, [0, 0.4], [0, 0.0])
    close(f[0, 2], found.forces["prescribed"][0])
    close(f[1, 2], 0.0)


def test_pendulum_swings():
    """A rod of 1 kg and 1 m from rest, level: its pin carries a quarter of its weight at first, and 5/2 of it at the bottom."""
    model = pc.chain(1)
    run = pc.Scene(model).add(E.Gravity(g=(0, -10, 0))).simulate(2.0, [0.0], events={"bottom": lambda t, state: state.q[0] + np.pi / 2})
    first, lowest = run.at(0.0), run.events["bottom"]
    close(first.interbody_forces("hinge0", axes="world"), [0, 0, 0, 0, 2.5, 0], 1e-9)
    bottom = run.at(lowest.t[0])
    close(bottom.interbody_forces("hinge0", axes="world"), [0, 0, 0, 0, 25.0, 0], 1e-6)


def test_frames_that_move_are_where_they_are():
    model = pc.chain(1)
    turn = lambda t: np.block(
        [[np.array([[np.cos(t), -np.sin(t), 0], [np.sin(t), np.cos(t), 0], [0, 0, 1]]), np.array([[t], [0], [0]])], [0, 0, 0, 1]]
    )
    model.add_frame("radar", motion=turn)
    run = pc.Scene(model).add(E.Gravity(g=(0, -10, 0))).simulate(0.5, [0.0], t_eval=[0.0, 0.5])
    world, seen = run.interbody_forces("hinge0", axes="world"), run.interbody_forces("hinge0", axes="radar")
    for i, t in enumerate(run.t):
        R = turn(t)[:3, :3]
        close(seen[i], np.r_[R.T @ (world[i, :3] - np.cross([t, 0, 0], world[i, 3:])), R.T @ world[i, 3:]])


def test_batches_are_rows():
    model, scene, _ = pushed_model()
    scene.add(E.NoseHoover(2.0, 0.5))
    states = [model.random_state(i) for i in range(3)]
    q, v, own = np.array([s.q for s in states]), np.array([s.v for s in states]), np.arange(18.0).reshape(3, 6) / 9
    for axes, hinge in (("body", None), ("world", list(model.hinges)[2]), ("body3", None)):
        each = [scene.interbody_forces(hinge, q[b], v[b], 0.3, states=own[b], axes=axes) for b in range(3)]
        close(scene.interbody_forces(hinge, q, v, 0.3, states=own, axes=axes), np.array(each))
    close(scene.interbody_forces(None, q[0], v)[2], scene.interbody_forces(None, q[0], v[2]))
    close(scene.interbody_forces(None, q[:1]), scene.interbody_forces(None, q[0])[None])
    assert scene.interbody_forces(None, q[:0], v[:0], states=own[:0], axes="world").shape == (0, len(model.bodies), 6)
    with pytest.raises(pc.ModelError, match=r"q \(3, \d+\), v \(2, \d+\) and states .* are batches of different sizes"):
        scene.interbody_forces(None, q, v[:2])


def test_refusals():
    model, scene, _ = pushed_model()
    for t in (np.nan, np.inf):
        for call in (scene.interbody_forces, scene.evaluate, scene.equilibrium):
            with pytest.raises(pc.EvaluationError, match=f"t is {t}; a time is a finite number of seconds"):
                call(t=t)
    with pytest.raises(pc.ModelError, match="elbow"):
        scene.interbody_forces("elbow")
    with pytest.raises(pc.EvaluationError, match="'reaction'"):
        scene.interbody_forces(part="half")
    with pytest.raises(pc.ModelError, match="q"):
        scene.interbody_forces(q=[0.0])
    with pytest.raises(pc.ModelError, match="not finite|nan"):
        scene.interbody_forces(q=np.full(model.nq, np.nan))
