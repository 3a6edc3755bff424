"""Stick figures: what is drawn is where the model says, for every model and view, and moves with it."""

import time

import matplotlib
import numpy as np
import pytest

import pycraft as pc
from pycraft.view import StickFigure
from pycraft.view.skeleton import BASE, Skeleton, placed, turned
from pycraft.view.stick_figure import HINGES, VIEWS
from support.mechanisms import every_kind

matplotlib.use("Agg")

import matplotlib.pyplot as plt  # noqa: E402 - after its backend is chosen

ROD = dict(mass=2.0, com=(0.5, 0, 0), inertia=np.diag([0, 2 / 12, 2 / 12]))


@pytest.fixture(autouse=True)
def closed():
    yield
    plt.close("all")


def shown_points(part):
    """Places (n, 2) or (n, 3) that a marker is drawn at."""
    artist = part.artist
    return np.array(artist.get_data_3d() if hasattr(artist, "get_data_3d") else artist.get_data(), float).T


def shown_lines(part):
    artist = part.artist
    return np.array(artist._segments3d if hasattr(artist, "_segments3d") else artist.get_segments(), float).reshape(
        -1, 2, shown_columns(part)
    )


def shown_columns(part):
    return 3 if hasattr(part.artist, "_segments3d") else 2


def all_in_view(figure):
    """Check that everything drawn is within the limits of the axes."""
    ax = figure.ax
    names = "xyz" if ax.name == "3d" else "xy"
    low, high = np.array([getattr(ax, f"get_{name}lim")() for name in names]).T
    parts = [shown_points(part) for part, _ in figure._joints.values()] + [shown_points(figure._nodes), shown_points(figure._base)]
    parts += [shown_lines(part).reshape(-1, len(names)) for part in figure._lines.values()]
    everything = np.concatenate(parts)
    return bool(np.all(everything >= low - 1e-12) and np.all(everything <= high + 1e-12))


# What is where --------------------------------------------------------------------------------------------------------


def test_a_chain_of_rods_is_drawn_rod_by_rod():
    model, q = pc.chain(5), np.array([0.3, -0.2, 0.5, 0.1, 0.4])
    figure = StickFigure(model, q)
    assert figure.ax.name == "rectilinear" and (figure.ax.get_xlabel(), figure.ax.get_ylabel()) == ("x (m)", "y (m)")
    ends = np.vstack([np.zeros(2), np.cumsum([[np.cos(a), np.sin(a)] for a in np.cumsum(q)], axis=0)])
    bones = shown_lines(figure._lines["bone"])
    np.testing.assert_allclose(sorted(bones[:, 0].tolist()), sorted(ends[:-1].tolist()), atol=1e-12)
    np.testing.assert_allclose(sorted(bones[:, 1].tolist()), sorted(ends[1:].tolist()), atol=1e-12)  # the last ends with its mass
    np.testing.assert_allclose(shown_points(figure._joints["pin"][0]), ends[:-1], atol=1e-12)


@pytest.mark.parametrize("seed", range(3))
def test_axes_are_those_about_which_hinges_turn(seed):
    """The rows of Jacobians: what a hinge's first and last coordinate turns stands still along the axis that is drawn."""
    model = every_kind(seed=seed)
    q = model.random_state(seed).q
    skeleton = Skeleton(model)
    poses = skeleton.poses(q)
    hinge, owner, point, direction = skeleton.axes
    places, directions = placed(poses, owner, point), turned(poses, owner, direction)
    seen = 0
    for k, o, place, along in zip(hinge, owner, places, directions, strict=True):
        body, kind = skeleton.bodies[k], skeleton.kinds[k]
        columns = model.hinges[skeleton.names[k]].v_slice
        column = columns.stop - 1 if o == k else columns.start
        omega, v = np.split(model.jacobian(body, q, axes="world")[:, column], 2)
        if kind in ("slider", "cylindrical"):
            omega, v = v if kind == "slider" else model.jacobian(body, q, axes="world")[:3, columns.start], np.zeros(3)
        assert abs(np.cross(omega, along)).max() < 1e-9 and np.linalg.norm(omega) > 0.99, kind
        if kind in ("pin", "universal", "gimbal"):
            assert abs(v + np.cross(omega, place)).max() < 1e-9, kind
        seen += 1
    assert seen == 5 + 2 * 3  # pin, slider, screw, cylindrical, planar; universal, gimbal, custom; none of welds, balls and free ones
    assert len(skeleton.names) == 11


def test_every_line_ends_on_what_it_joins():
    model = every_kind()
    q = model.random_state(1).q
    skeleton = Skeleton(model)
    poses = skeleton.poses(q)
    assert np.array_equal(poses[:-1], [model.pose(name, q) for name in model.bodies]) and np.array_equal(poses[BASE], np.eye(4))
    joints = placed(poses, *skeleton.points["joint"])
    np.testing.assert_allclose(placed(poses, *skeleton.points["node"]), [model.pose(name, q)[:3, 3] for name in model.nodes], atol=1e-12)
    bones = placed(poses, *skeleton.lines["bone"])
    slides = placed(poses, *skeleton.lines["slide"])
    for k, kind in enumerate(skeleton.kinds):
        if kind in ("pin", "ball", "slider", "universal", "custom"):  # a bone of the parent ends there, or with what slides from it
            reached = [bone[1] for bone in bones if np.linalg.norm(bone[1] - joints[k]) < 1e-12]
            reached += [bone[1] for bone in bones for a, b in slides if np.linalg.norm([*(bone[1] - a), *(b - joints[k])]) < 1e-12]
            assert reached, kind
    starts = np.array([np.linalg.norm(bones[:, 0] - joint, axis=1).min() for joint in joints])
    assert starts.max() < 1e-12  # every body has a bone, also one that carries only a body on a free hinge


def test_markers_are_at_the_hinges_of_their_kind():
    model = every_kind()
    q = model.random_state(2).q
    figure = StickFigure(model, q)
    for body in model.bodies.values():
        turning = [s["point"] for s in body.hinge.subhinges if s["kind"] not in ("slider", "free")]
        place = (model.pose(body.name, q) @ [*(turning[-1] if turning else np.zeros(3)), 1])[:3]
        np.testing.assert_allclose(shown_points(figure._joints[body.hinge.kind][0]), [place], atol=1e-12)
    assert not len(shown_points(StickFigure(pc.robots.a1())._base))  # all that there is flies


def test_what_slides_is_dashed_from_where_it_was():
    cart = pc.Multibody("cart")
    cart.add_body("cart", hinge="slider", axis=(1, 0, 0), position=(0, 0, 0.5), mass=1.0)
    figure = StickFigure(cart, [0.75])
    (slide,) = shown_lines(figure._lines["slide"])
    assert figure.canvas.columns == VIEWS["xz"] and slide.tolist() == [[0, 0.5], [0.75, 0.5]]
    assert shown_points(figure._base).tolist() == [[0, 0]] and shown_lines(figure._lines["ground"]).tolist() == [[[0, 0], [0, 0.5]]]


def test_where_mass_ends():
    """A rod's end; three lines of a body that is about its hinge; nodes in its place."""
    model = pc.Multibody("ends")
    model.add_body("rod", hinge="ball", **ROD)
    lines = Skeleton(model).lines["bone"]
    np.testing.assert_allclose(lines[1], [[[0, 0, 0], [1, 0, 0]]], atol=1e-12)
    model.add_body("box", hinge="free", mass=3.0, inertia=np.diag([4 + 9, 1 + 9, 1 + 4]) * 3 / 12)  # of edges 1, 2 and 3
    lines = Skeleton(model).lines["bone"][1][1:]
    extent = np.sort(np.ptp(lines, axis=1).max(axis=1))
    np.testing.assert_allclose(extent, [1, 2, 3])
    model.add_node("near", "rod", position=(0.01, 0, 0))
    assert len(Skeleton(model).lines["tie"][0]) == 1  # no end: the rod's own is
    model.add_node("tip", "rod", position=(0.4, 0, 0.3))
    skeleton = Skeleton(model)
    assert [0.4, 0, 0.3] in skeleton.lines["bone"][1][:, 1].tolist() and [1, 0, 0] not in skeleton.lines["bone"][1][:, 1].tolist()


def test_centres_of_mass():
    model = every_kind()
    q = model.random_state(3).q
    figure = StickFigure(model, q, com=True)
    bodies = model.bodies.values()
    each = np.array([(model.pose(body.name, q) @ [*body.com, 1])[:3] for body in bodies])
    np.testing.assert_allclose([shown_points(part)[0] for part in figure._masses[:-1]], each, atol=1e-12)
    whole = np.average(each, axis=0, weights=[body.mass for body in bodies])
    np.testing.assert_allclose(shown_points(figure._masses[-1])[0], whole, atol=1e-12)
    areas = [part.artist.get_markersize() ** 2 for part in figure._masses[:-1]]
    np.testing.assert_allclose(np.divide(areas, areas[0]), [body.mass / model.bodies["body0"].mass for body in bodies])


# Every model ----------------------------------------------------------------------------------------------------------


def welded(welds):
    return pc.tree([-1, 0, 1], "weld", welds=welds)


def point_mass():
    model = pc.Multibody("point")
    model.add_body("p", hinge="free", mass=1.0)
    return model


def massless():
    model = pc.Multibody("massless")
    model.add_body("p")
    return model


MODELS = {
    "nothing": lambda: pc.Multibody("nothing"),
    "one": lambda: pc.chain(1),
    "kept welds": lambda: welded("keep"),
    "lumped welds": lambda: welded("lump"),
    "point": point_mass,
    "massless": massless,
    "kinds": every_kind,
    **{kind: lambda kind=kind: pc.chain(2, kind, seed=1) for kind in HINGES if kind != "weld"},
    **{name: getattr(pc.robots, name) for name in pc.robots.names()},
}


@pytest.mark.parametrize("name", MODELS)
@pytest.mark.parametrize("view", VIEWS)
def test_every_model_in_every_view(name, view):
    model = MODELS[name]()
    figure = StickFigure(model, view=view, com=True, names=True)
    assert (figure.ax.name == "3d") == (view == "3d") and all_in_view(figure)
    figure.ax.figure.canvas.draw()
    state = model.random_state(0)
    assert figure.update(state) is figure.artists
    figure.frame(state.q)
    assert all_in_view(figure)
    labels = [f"{name} (m)" for name in ("xyz" if view == "3d" else view)]
    assert [getattr(figure.ax, f"get_{name}label")() for name in "xyz"[: len(labels)]] == labels


@pytest.mark.parametrize("view", ["xy", "3d"])
def test_scales_are_equal(view):
    figure = StickFigure(pc.chain(4), [0.5, 0, 0, 0], view=view)
    ax = figure.ax
    if view == "3d":
        ranges = [np.ptp(getattr(ax, f"get_{name}lim")()) for name in "xyz"]
        np.testing.assert_allclose(np.asarray(ax._box_aspect) / ax._box_aspect[0], np.divide(ranges, ranges[0]))
    else:
        assert ax.get_aspect() == 1


def test_a_thousand_links_quickly():
    model = pc.chain(1000, "ball")
    q = model.random_state(0).q
    begin = time.perf_counter()
    figure = StickFigure(model, q)
    figure.ax.figure.canvas.draw()
    first, begin = time.perf_counter() - begin, time.perf_counter()
    figure.update(model.zero_q())
    assert first < 10 and time.perf_counter() - begin < 3  # a tenth of these on an idle core
    assert len(figure.artists) < 12


def test_planes_that_models_never_leave():
    flat = {name: Skeleton(make()).normals() for name, make in MODELS.items()}
    assert flat["one"] == flat["massless"] == (2,) and not any(flat[name] for name in flat if name not in ("one", "massless"))
    model = pc.Multibody("flat")
    model.add_body("cart", hinge="slider", axis=(1, 0, 0), mass=1.0)
    assert Skeleton(model).normals() == (1, 2) and StickFigure(model).canvas.columns == VIEWS["xz"]
    model.add_body("pole", "cart", axis=(0, 1, 0), **ROD)
    assert Skeleton(model).normals() == (1,)
    beside = pc.Multibody.from_description(model.description())
    model.add_body("lift", "pole", hinge="slider", axis=(0, 1e-3, 1), **ROD)
    assert Skeleton(model).normals() == () and StickFigure(model).ax.name == "3d"
    beside.add_body("wheel", "pole", axis=(0, 1, 0), position=(0, 0.1, 0), **ROD)  # moves along the plane, and is not in it
    assert Skeleton(beside).normals() == ()


def test_a_base_that_is_far_off():
    model = pc.Multibody("far")
    model.add_body("rod", position=(1e8, 0, 0), **ROD)
    figure = StickFigure(model)
    assert np.ptp(figure.ax.get_xlim()) < 2 and shown_points(figure._base).tolist() == [[1e8, 0]] and all_in_view(figure)


def test_up_is_where_gravity_does_not_pull():
    robot = pc.robots.panda()
    assert StickFigure(robot).ax._vertical_axis == 2
    robot.gravity = (0, -9.81, 0)
    figure = StickFigure(robot)
    assert figure.ax._vertical_axis == 1
    floor = shown_lines(figure._shadow)[..., 1]
    assert np.all(floor == figure.ax.get_ylim()[0])


# Moving, and beside others --------------------------------------------------------------------------------------------


@pytest.mark.parametrize("view", ["3d", "xz"])
def test_a_figure_that_moved_is_one_drawn_there(view):
    model = every_kind()
    start, end = model.random_state(0).q, model.random_state(1).q
    moved = StickFigure(model, start, view=view, com=True, names=True)
    moved.frame(end)
    moved.update(end)
    drawn = StickFigure(model, end, view=view, com=True, names=True)
    for one, other in zip(moved.artists, drawn.artists, strict=True):
        if hasattr(one, "get_segments"):
            places = [np.asarray(artist._segments3d if view == "3d" else artist.get_segments()) for artist in (one, other)]
        elif hasattr(one, "get_text"):
            places = [np.array(a.get_position_3d() if view == "3d" else a.get_position()) for a in (one, other)]
        else:
            places = [np.array(a.get_data_3d() if view == "3d" else a.get_data()) for a in (one, other)]
        np.testing.assert_array_equal(*places)


def test_a_motion_in_view_and_animated(tmp_path):
    from matplotlib.animation import FuncAnimation

    model = pc.chain(3)
    states = np.array([[t, t, 0] for t in np.linspace(0, 3, 4)])
    figure = StickFigure(model, states[0])
    figure.frame(states)
    for q in states:
        figure.update(q)
        assert all_in_view(figure)
    motion = FuncAnimation(figure.ax.figure, lambda i: figure.update(states[i]), frames=4, blit=True)
    motion.save(tmp_path / "motion.gif", writer="pillow")
    assert (tmp_path / "motion.gif").read_bytes()[:3] == b"GIF"


def test_several_states_in_one_picture():
    model = pc.chain(2)
    ax = model.plot([0, 0])
    low = ax.get_xlim()
    assert model.plot([3.1, 0], ax=ax, legend=False, alpha=0.3) is ax
    assert ax.get_xlim()[1] >= low[1] and ax.get_xlim()[0] < -2
    own = plt.subplots()[1]
    own.plot([0, 50], [0, 1])
    model.plot([0, 0], ax=own)
    assert own.get_xlim()[1] >= 50 and (own.get_xlabel(), own.get_title()) == ("x (m)", "")
    own.set_xlabel("mine")
    model.plot([0, 0], ax=own)
    assert own.get_xlabel() == "mine"
    space = plt.figure().add_subplot(projection="3d")
    assert model.plot(ax=space) is space
    assert pc.robots.panda().plot(ax=plt.subplots()[1], view="yz").name == "rectilinear"


def test_names_of_hinges_at_one_place_stand_below_each_other():
    figure = StickFigure(pc.robots.panda(), names=True)
    texts = [artist.get_text() for artist in figure._texts.artists]
    assert texts[:3] == ["  panda_joint1", "\n  panda_joint2", "  panda_joint3"]


def test_the_legend_counts():
    legend = pc.tree([-1, 0, 0, 2], ["pin", "pin", "slider", "weld"]).plot().figure.legends[0]
    assert [text.get_text() for text in legend.get_texts()] == ["base", "pin (2)", "slider (1)", "node (1)"]
    assert not pc.robots.a1().plot(legend=False).figure.legends
    texts = [text.get_text() for text in pc.robots.a1().plot(com=True).figure.legends[0].get_texts()]
    assert texts == ["free (1)", "pin (12)", "node (5)", "centre of mass"]  # nothing is on the base


def test_kinds_are_told_apart_by_shape_alone():
    markers = [marker for marker, _ in HINGES.values()]
    assert len(set(markers)) == len(markers) and set(HINGES) == set(pc._core.hinge_kinds)


# Errors ---------------------------------------------------------------------------------------------------------------


def test_what_is_refused():
    model = pc.chain(2)
    with pytest.raises(pc.ModelError, match=r"q of 'chain of 2 rods' takes 2 numbers .*, not 3"):
        model.plot([0, 0, 0])
    with pytest.raises(pc.ModelError, match="q"):
        model.plot(np.zeros((3, 2)))
    with pytest.raises(pc.ModelError, match="entry 0 is nan"):
        model.plot([np.nan, 0])
    with pytest.raises(pc.EvaluationError, match=r"view='top': there are 'auto', '3d', 'xy', 'xz', 'yz'"):
        model.plot(view="top")
    with pytest.raises(pc.EvaluationError, match="view='3d' in axes of a plane: leave one of the two out"):
        model.plot(ax=plt.subplots()[1], view="3d")
    with pytest.raises(pc.EvaluationError, match="view='xy' in axes in space"):
        model.plot(ax=plt.figure().add_subplot(projection="3d"), view="xy")
    assert not plt.get_fignums()[3:]  # a refused figure is none
