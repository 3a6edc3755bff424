"""Stops by their coefficient of restitution: against runs, the equation's own integral, and its limit."""

import numpy as np
import pytest

import pycraft as pc
from support.sliders import slider

E, P = pc.effects, dict(progress=False)
FALL = np.sqrt(2 * 9.81)  # m/s, by 1 m


@pytest.mark.parametrize("e", [1.0, 0.9, 0.5, 0.2])
@pytest.mark.parametrize(("stiffness", "mass"), [(1e9, 1.0), (1e8, 3.0)])
def test_balls(e, stiffness, mass):
    """A fall of 1 m: gravity also acts within the stop, by g/ωv of the speed."""
    ball = pc.Multibody("ball")
    ball.add_body("b", hinge="slider", axis=(0, 0, 1), mass=mass, limits=(0, np.inf))
    run = pc.Scene(ball).add(E.Gravity(), E.Limits(stiffness, restitution=(e, FALL))).simulate(1.0, [1.0], [0.0], **P)
    w = run.events["limits"].v[:, 0]
    assert abs(-w[1] / w[0] - e) < 4 * 9.81 / (np.sqrt(stiffness / mass) * FALL)


@pytest.mark.parametrize("e", [1 - 1e-6, 0.99, 0.94, 0.93, 0.5, 0.1, 1e-3])
def test_the_equation(e):
    """∫ v dv/(1 + a v) from 1 to -e is zero, in 60 digits."""
    mpmath = pytest.importorskip("mpmath")
    with mpmath.workdps(60):
        low, high = mpmath.mpf(1 - e) / 10, 1 / mpmath.mpf(e)
        for _ in range(200):
            a = (low + high) / 2
            excess = a * (1 + mpmath.mpf(e)) - mpmath.log((1 + a) / (1 - a * mpmath.mpf(e)))
            low, high = (a, high) if excess > 0 else (low, a)
        found = E.Limits(1.0, restitution=(e, 2.0))._dissipation()[0]
        assert abs(2 * found / a - 1) < 1e-15 / (1 - e)  # what a logarithm is rounded to, where three terms of it cancel


def test_one_for_each_coordinate():
    limits = E.Limits(1e4, lower=-1, upper=1, restitution=([0.5, 0.9], [1.0, 2.0]))
    one, two = (E.Limits(1e4, restitution=pair)._dissipation()[0] for pair in ((0.5, 1.0), (0.9, 2.0)))
    arm = pc.chain(2)
    assert limits._dissipation() == [one, two] and limits.by_coordinate() == {""}
    a, b = (pc.Scene(arm).add(x) for x in (limits, E.Limits(1e4, [one, two], -1, 1)))
    q, v = [1.1, -1.2], [0.4, -0.3]
    assert np.array_equal(a.evaluate(q, v).vdot, b.evaluate(q, v).vdot)


def test_of_files_and_edits():
    """The pair is no list of numbers by coordinate, and reads back."""
    model = slider(limits=(-1.0, 1.0))
    scene = pc.Scene(model).add(E.Limits(restitution=(0.5, 1.0)))
    assert scene.effects["limits"].by_coordinate() == set()
    again = pc.Scene.from_dict(scene.to_dict())
    assert list(again.effects["limits"].restitution) == [0.5, 1.0]
    model.add_body("more", "b", axis=(0, 0, 1), mass=1.0, com=(1.0, 0, 0))
    assert np.isfinite(scene.evaluate([0.0, 0.0], [0.0, 0.0]).vdot).all()


@pytest.mark.parametrize(
    ("given", "said"),
    [
        (dict(dissipation=1.0, restitution=(0.5, 1.0)), "give either dissipation or restitution"),
        (dict(restitution=0.5), r"a pair \(e, v\), a coefficient and the speed at which it holds, not 0.5"),
        (dict(restitution=(0.5,)), r"a pair \(e, v\)"),
        (dict(restitution=(0.0, 1.0)), "above 0 and no more than 1, not 0"),
        (dict(restitution=(1.1, 1.0)), "above 0 and no more than 1, not 1.1"),
        (dict(restitution=(np.nan, 1.0)), "above 0 and no more than 1, not nan"),
        (dict(restitution=(0.5, 0.0)), "positive and finite, not 0"),
        (dict(restitution=(0.5, np.inf)), "positive and finite, not inf"),
        (dict(restitution=([0.5, 0.4], [1.0, 1.0, 1.0])), "2 coefficients and 3 speeds"),
        (dict(restitution=("e", 1.0)), "e of restitution is not an array of numbers"),
    ],
)
def test_refused(given, said):
    with pytest.raises(pc.ModelError, match=said):
        pc.Scene(slider()).add(E.Limits(1e4, lower=-1, upper=1, **given))
