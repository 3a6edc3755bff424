"""Loops through TOML files: rows come back to the last bit, and what a file gets wrong is said with its line."""

import numpy as np
import pytest

import pycraft as pc
from support.mechanisms import every_kind
from support.saved_models import saved_and_loaded

RING = np.array([[1.0, 0, 0], [0, 1, 0.1], [-1, 0, 0], [0, -1, 0], [1, 0, 0]])
TURN = np.array([[0.36, 0.48, -0.8], [-0.8, 0.6, 0.0], [0.48, 0.64, 0.6]])


def with_loops():
    model = every_kind(seed=8)
    model.add_node("eye", "body10", position=(0.1, 0.2, 0.3))
    model.add_coupling({"hinge1": [0.1, 2.0, 1 / 3], "hinge7[1]": -1.0}, constant=-0.0, name="cable")
    model.add_loop(
        "eye", "body3", "screw", axis=(1, 2, 3), point=(0.1, 0, 0), pitch=0.2, rotation=TURN, position=(1, 0, 1 / 3), name="screw"
    )
    model.add_loop("body9", None, "universal", axes=[(1, 2, 0), (0, 1, 1)], name="universal")
    model.add_loop("body9", "body3", "gimbal", name="gimbal")
    model.add_loop("body3", "eye", "weld", placement=np.block([[np.eye(3), np.ones((3, 1))], [np.zeros((1, 3)), 1]]), name="weld")
    model.add_surface("body9", "body3", A=TURN, b=(0, 1, 1 / 3), c=-1.0, name="surface")
    model.add_surface("body9", b=(0, 1, 0), name="plane")
    model.add_curve("eye", "body3", curve=[[0, 0, 0], [1, 0.5, 1 / 3], [2, 0, 0]], name="wire")
    model.add_curve("eye", curve=RING, closed=True, name="ring")
    model.add_rolling("eye", radius=0.3, name="wheel")
    model.add_rolling("eye", kind="ball", radius=1 / 3, name="ball")
    model.add_rolling("eye", "body3", "blade", name="blade")
    model.add_loop("eye", name="free pin")
    return model


def test_rows_come_back_to_the_last_bit(tmp_path):
    model = with_loops()
    again = saved_and_loaded(model, tmp_path / "model.toml")
    assert again.loops.rows == model.loops.rows and [again.loops[n].kind for n in again.loops] == [model.loops[n].kind for n in model.loops]
    assert again.loops.residual().tobytes() == model.loops.residual().tobytes()
    assert again.loops.jacobian().tobytes() == model.loops.jacobian().tobytes()
    assert again.loops.bias().tobytes() == model.loops.bias().tobytes()
    again.save(tmp_path / "again.toml")
    assert (tmp_path / "again.toml").read_text() == (tmp_path / "model.toml").read_text()


def test_what_files_do_not_hold_is_said(tmp_path):
    model = pc.chain(2)
    model.add_coupling(["hinge0"], function=lambda q: (q[0], [1.0], [[0.0]]), name="cam")
    with pytest.warns(pc.ModelWarning, match="no file holds couplings by functions, and these were not written: cam"):
        model.save(tmp_path / "model.toml")
    assert list(pc.load(tmp_path / "model.toml").loops) == []
    with pytest.warns(pc.ModelWarning, match="no file holds couplings by functions, and these were not written: cam"):
        model.save(tmp_path / "model.urdf")


BODY = '[[bodies]]\nname = "arm"\n'


@pytest.mark.parametrize(
    ("loop", "line", "said"),
    [
        ('name = "x"\nb = "arms"', 3, "no frame of 'm' is called 'arms'"),
        ('name = "x"\nkind = "pins"\nb = "arm"', 5, "loop 'x': kind = 'pins'; did you mean 'pin'?"),
        ('name = "x"\nb = "arm"\nradius = 1', 6, "loop 'x' of kind 'pin' has no radius; it has a, b, axis, axes, point"),
        ('name = "x"\nkind = "wheel"\nb = "arm"\naxis = [0, 0, 1]', 7, "loop 'x' of kind 'wheel' has no axis; it has a, b, radius"),
        ('name = "x"\nkind = "wheel"\nb = "arm"', 3, "a radius is a positive number (m), not 0"),
        ('name = "x"\nb = "arm"\naxiss = [0, 0, 1]', 6, "loop 'x' has no key 'axiss'; did you mean 'axis'?"),
        ('name = "x"\nb = "arm"\naxis = [0, 1]', 6, "loop 'x': axis = [0, 1]; write three finite numbers: [x, y, z]"),
        ('name = "x"\nb = "arm"\naxis = [0, 0, 0]', 3, "hinge 'x': its axis has length 0"),
        ('b = "arm"', 3, "loop number 1 has no name"),
        ('name = "x"', 3, "loop 'x' is of the base with itself"),
        ('name = "x"\nkind = "coupling"', 3, "loop 'x' has no coordinates; write coordinates = { motor = 1, wheel = -3 }"),
        ('name = "x"\nkind = "coupling"\ncoordinates = { leg = 1 }', 3, "no hinge or coordinate of 'm' is called 'leg'"),
        ('name = "x"\nkind = "coupling"\ncoordinates = { arm = "one" }', 6, "arm = 'one'; write a finite number"),
        (
            'name = "x"\nkind = "coupling"\na = "arm"\ncoordinates = { arm = 1 }',
            6,
            "loop 'x' of kind 'coupling' has no a; it has coordinates, constant",
        ),
        ('name = "x"\nkind = "custom"\nb = "arm"', 3, "loop 'x': a custom hinge takes subhinges=[...]"),
        ('name = "x"\nkind = "custom"\nb = "arm"\nsubhinges = [{axis = [0, 0, 1]}]', 7, 'has no kind; give it one: kind = "pin"'),
        (
            'name = "x"\nkind = "custom"\nb = "arm"\naxis = [0, 0, 1]',
            7,
            "loop 'x' of kind 'custom' has no axis; it has a, b, subhinges, position",
        ),
    ],
)
def test_what_a_file_gets_wrong(tmp_path, loop, line, said):
    path = tmp_path / "m.toml"
    path.write_text(f"{BODY}[[loops]]\n{loop}\n")
    with pytest.raises(pc.ModelError) as caught:
        pc.load(path)
    assert f"m.toml:{line}: " in str(caught.value) and said in str(caught.value)
