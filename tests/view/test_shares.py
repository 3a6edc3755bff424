"""Shares of the degrees of freedom: against Jacobians and the mass matrix, which know no sweep; and how they are shown."""

import re

import numpy as np
import pytest

import pycraft as pc
from pycraft.view import StickFigure
from pycraft.view.colour_scale import ramp, shade
from pycraft.view.shares import share_values
from support.mechanisms import every_kind


def by_definition(model, q):
    """tr(J_k ℳ⁻¹ J_k* M(k)) by the bodies' Jacobians, and tr(ℳ⁻¹ J) with ℳ⁻¹ formed: no recursion of Υ."""
    MM_inverse = np.linalg.inv(model.mass_matrix(q))
    described = model.description()["bodies"]
    shares = []
    for body in described:
        jacobian, c, m = model.jacobian(body["name"], q), np.array(body["com"]), body["mass"]
        skew = np.array([[0, -c[2], c[1]], [c[2], 0, -c[0]], [-c[1], c[0], 0]])
        M = np.block([[body["inertia"] - m * skew @ skew, m * skew], [-m * skew, m * np.eye(3)]])
        shares.append(np.trace(jacobian @ MM_inverse @ jacobian.T @ M))
    rotors = np.concatenate([np.broadcast_to(body["hinge"]["rotor_inertia"], hinge.v_slice.stop - hinge.v_slice.start)
                             for body, hinge in zip(described, model.hinges.values(), strict=True)])  # fmt: skip
    return np.array(shares), float(np.diag(MM_inverse) @ rotors)


MODELS = {
    "one": lambda: pc.chain(1),
    "chain": lambda: pc.chain(5, seed=2),
    "rotors": lambda: pc.tree([-1, 0, 0, 1], ["pin", "ball", "universal", "slider"], seed=3, rotor_inertia=True),
    "every kind": every_kind,
    "two trees": lambda: pc.tree([-1, -1, 1], ["free", "pin", "ball"], seed=1),
}


@pytest.mark.parametrize("name", MODELS)
def test_shares_are_what_the_definition_says(name):
    model = MODELS[name]()
    q = model.random_state(4).q
    shares, (bodies, rotors) = model.dof_shares(q), by_definition(model, q)
    error = 1e-13 * np.linalg.cond(model.mass_matrix(q))  # the inverse's, of some dozens of sums
    np.testing.assert_allclose(shares.values, bodies, rtol=0, atol=error)
    assert shares.of_rotors == pytest.approx(rotors, abs=error) and (rotors > 0) == (shares.of_rotors > 0)
    assert shares.total == pytest.approx(model.nv, abs=error) and shares.coordinates == model.nv
    assert list(shares.by_body) == list(model.bodies) and (shares.values > -error).all() and (shares.values < 6 + error).all()


def test_what_is_alone_has_all_of_its_directions():
    model = pc.tree([-1, -1], ["free", "pin"], seed=1)
    assert model.dof_shares().values == pytest.approx([6, 1], abs=1e-12)
    light = pc.Multibody("light on heavy")
    light.add_body("heavy", hinge="slider", axis=(1, 0, 0), mass=1e9, inertia=np.eye(3))
    light.add_body("light", parent="heavy", hinge="slider", axis=(1, 0, 0), mass=1.0, inertia=np.eye(3))
    # Together they are the number of coordinates; the light one moves as if the other were at rest, up to the ratio of masses, 1e-9.
    assert light.dof_shares().values == pytest.approx([1, 1], abs=1e-8)


def test_the_base_that_is_chosen_changes_nothing():
    model = pc.tree([-1, 0, 1, 1], ["free", "pin", "ball", "pin"], seed=1)
    model.q = model.random_state(0).q
    first = model.dof_shares().by_body
    model.reroot("body3")
    assert model.dof_shares().by_body == pytest.approx(first, rel=1e-12)


def test_nothing_moves_and_nothing_can_be_said():
    welded = pc.Multibody("welded", welds="keep")
    welded.add_body("a", hinge="weld", mass=1.0, inertia=np.eye(3))
    shares = welded.dof_shares()
    assert shares.total == 0 and set(shares.values) <= {0.0} and shares.coordinates == 0
    assert "together 0 of N = 0" in repr(shares) and "nan" not in shares._repr_html_()
    with pytest.raises(pc.ModelError):
        pc.chain(2).dof_shares([0.0])
    massless = pc.Multibody("massless")
    massless.add_body("a", hinge="pin", axis=(0, 0, 1), mass=0.0, inertia=np.zeros((3, 3)))
    with pytest.warns(pc.ModelWarning), pytest.raises(pc.SingularHingeError, match="'a'"):
        massless.dof_shares()


# How they are shown ---------------------------------------------------------------------------------------------------


def test_the_table_tells_the_largest_of_many():
    lines = repr(pc.chain(40, seed=1).dof_shares()).split("\n")
    numbers = [float(line.split()[1]) for line in lines[1:-2]]
    assert len(numbers) == 24 and numbers == sorted(numbers, reverse=True)
    assert lines[-2:] == ["  and 16 more with smaller shares", "  together 40 of N = 40"]
    assert max(map(len, lines)) <= 80


def test_the_picture_has_a_colour_a_body_and_says_the_sum():
    model = pc.tree([-1, 0, 0], ["pin", "pin", "ball"], seed=2, rotor_inertia=True)
    shares = model.dof_shares()
    page = shares._repr_html_()
    shown = re.findall(r"<circle[^>]*fill='(#\w+)'[^>]*><title>(\w+): ([\d.]+)</title>", page)
    high = max(shares.values)
    assert [(name, float(x)) for _, name, x in shown] == [(name, pytest.approx(x, rel=1e-3)) for name, x in shares.by_body.items()]
    assert [colour for colour, *_ in shown] == [shade(x, 0, high) for x in shares.values]
    assert shares.said in page and "rotors" in shares.said and f"{high:.3g}</text>" in page and "http" not in page


def test_matplotlibs_figure_follows_a_state():
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot
    from matplotlib.colors import to_hex

    from pycraft.view import StickFigure

    for model in (pc.mechanisms.double_pendulum().model, pc.tree([-1, 0], ["ball", "pin"], seed=1)):
        shares = model.dof_shares()
        ax = shares.plot()
        assert "together" in ax.get_title() and any("share" in other.get_ylabel() for other in ax.figure.axes)
        figure = StickFigure(model)
        figure.paint(shares.values, "share")
        figure.ax.figure.canvas.draw()  # in space, colours are put in order of depth as they are drawn
        colours = [to_hex(c) for c in figure._painted.artist.get_facecolor()]
        assert sorted(colours) == sorted(shade(x, 0, max(shares.values)) for x in shares.values)
        figure.update(model.random_state(1).q)
        assert figure._painted.artist in figure.artists
        with pytest.raises(pc.EvaluationError, match=r"one value per body of .*\(2,\)"):
            figure.paint([1.0], "share")
        pyplot.close("all")


def test_colours_are_told_apart():
    assert len(set(ramp())) == 9 and shade(0, 0, 1) == ramp()[0] and shade(1, 0, 1) == ramp()[-1] and shade(0.5, 0, 1) == ramp()[4]
    assert (
        shade(7, 0, 1) == ramp()[-1] and shade(-7, 0, 1) == ramp()[0] and shade(np.nan, 0, 1) == "#9a9a9a" and shade(3, 3, 3) == ramp()[0]
    )
    light = [np.dot([0.2126, 0.7152, 0.0722], [int(c[i : i + 2], 16) for i in (1, 3, 5)]) for c in ramp()]
    assert np.all(np.diff(light) > 5)  # from dark to light: readable without colour


def test_values_are_of_the_state_that_is_given():
    model = pc.chain(3, seed=1)
    model.q = [0.1, 0.2, 0.3]
    assert not np.allclose(share_values(model, np.zeros(3)), model.dof_shares().values)
    np.testing.assert_array_equal(share_values(model, np.array([0.1, 0.2, 0.3])), model.dof_shares().values)


def test_pictures_of_many_bodies_are_tables():
    many = pc.chain(301).dof_shares()
    assert many._repr_html_().startswith("<pre>") and "more with smaller shares" in many._repr_html_()


def test_shares_are_of_the_model_as_it_was():
    arm = pc.chain(2)
    shares = arm.dof_shares()
    shown = shares._repr_html_()
    arm.add_body("more", "body1", "pin", mass=1.0)
    assert shares._repr_html_() == shown


def test_painting_again_replaces_the_bar():
    figure = StickFigure(pc.chain(2))
    for high in (1.0, 2.0):
        figure.paint([0.1, 0.2], "shares", 0.0, high)
    assert len(figure.ax.figure.axes) == 2
