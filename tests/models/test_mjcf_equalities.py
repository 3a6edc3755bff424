"""Equality constraints of MJCF files as loops, against the residuals and Jacobians of MuJoCo's own rows.

MuJoCo takes positions in world axes, where ours are those of a body, and turns by another measure: what is compared is |r| and its
gradient where that is the same, and where loops are closed what the rows span. Rounding: `ROUNDING` (oracle.py); where loops are closed
1e-12, residuals of 1e-15 through the conditioning of the rows.
"""

import numpy as np
import pytest

import pycraft as pc
from pycraft.interop import mujoco as conventions
from support.oracle import agree

pytestmark = pytest.mark.peers

GEOM = '<geom type="box" size=".1 .2 .3" pos=".1 .2 -.1" euler="20 30 40"/>'
POSES = {"a": 'pos=".3 .1 -.2" euler="10 -20 30"', "b": 'pos=".5 0 .2" euler="40 0 -30"', "c": 'pos="-.4 .3 .1" euler="0 50 20"'}
SITE = '<site name="on {0}" pos=".1 -.2 .05" euler="10 20 -30"/>'


def body(name, joints, inside=""):
    return f'<body name="{name}" {POSES[name]}>{joints}{GEOM}{SITE.format(name)}{inside}</body>'


WORLD = (
    '<site name="on the ground" pos="1 .1 .3" euler="0 0 45"/>'
    + body(
        "a",
        '<joint name="x" axis="1 2 3"/><joint name="t" type="slide" axis="0 1 1" ref=".4"/>',
        body("b", '<joint name="y" ref="30" pos=".1 0 0"/>'),
    )
    + body("c", '<freejoint name="f"/>')
)
EQUALITIES = {
    "connect": '<connect name="e" body1="a" body2="c" anchor=".2 .1 -.3"/>',
    "connect to the world": '<connect name="e" body1="c" anchor=".2 .1 -.3"/>',
    "connect of sites": '<connect name="e" site1="on b" site2="on c"/>',
    "weld": '<weld name="e" body1="b" body2="c" anchor=".1 .2 .3"/>',
    "weld at a pose": '<weld name="e" body1="b" body2="c" relpose=".1 -.2 .3 .5 .5 -.5 .5" anchor=".1 .2 .3"/>',
    "weld to the world": '<weld name="e" body1="c"/>',
    "weld of sites": '<weld name="e" site1="on the ground" site2="on c"/>',
    "joint": '<joint name="e" joint1="y" joint2="x" polycoef=".1 -2 .5 .3 -.2"/>',
    "joint with references": '<joint name="e" joint1="t" joint2="y" polycoef=".1 -2 .5 .3 -.2"/>',
    "joint alone": '<joint name="e" joint1="t" polycoef=".1 0 0 0 0"/>',
}


@pytest.fixture
def load(tmp_path):
    mujoco = pytest.importorskip("mujoco")

    def load(equalities, world=WORLD):
        """Our model, and MuJoCo's rows of equalities at a state of it: efc_pos, and efc_J by our velocities."""
        path = tmp_path / "scene.xml"
        path.write_text(f'<mujoco model="scene"><worldbody>{world}</worldbody><equality>{equalities}</equality></mujoco>')
        with pytest.warns(pc.ModelWarning) as caught:
            model = pc.load(path)
        m = mujoco.MjModel.from_xml_path(str(path))
        m.opt.jacobian = mujoco.mjtJacobian.mjJAC_DENSE
        m.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONTACT)
        d = mujoco.MjData(m)

        def rows(q):
            d.qpos, d.qvel = conventions.to_mujoco(model, q, np.zeros(m.nv))
            mujoco.mj_forward(m, d)
            # ours are Tᵀ times MuJoCo's velocities, and T⁻ᵀ leads back
            J = np.array(d.efc_J).reshape(-1, m.nv)[: d.nefc] @ np.linalg.inv(conventions.velocity_map(model, q).T)
            of_equalities = np.array(d.efc_type) == int(mujoco.mjtConstraint.mjCNSTR_EQUALITY)
            return np.array(d.efc_pos)[of_equalities], J[of_equalities]

        return model, rows, [str(w.message) for w in caught]

    return load


@pytest.mark.parametrize("equality", EQUALITIES.values(), ids=EQUALITIES)
def test_rows_span_what_mujoco_s_do(load, equality):
    model, rows, said = load(equality)
    assert list(model.loops) == ["e"] and "loops of the model, which direct calls and scenes do not keep: 'e'" in said[0]
    for seed in range(3):
        state = model.assemble(model.random_state(seed))
        r, J = rows(state.q)
        assert np.abs(r).max() < 1e-12 and r.shape == (len(model.loops.rows),)
        both = np.linalg.svd(np.vstack([J, model.loops.jacobian(state)]), compute_uv=False)
        assert both[len(r) - 1] > 1e-3 and both[len(r) :].max() < 1e-12


@pytest.mark.parametrize("name", [name for name in EQUALITIES if name.startswith(("connect", "joint"))])
def test_open_residuals_are_mujoco_s(load, name):
    model, rows, _ = load(EQUALITIES[name])
    for seed in range(3):
        q = model.random_state(seed).q
        (r, J), own, Q = rows(q), model.loops.residual(q), model.loops.jacobian(q)
        agree(np.linalg.norm(own), np.linalg.norm(r))
        agree(own @ Q, r @ J)


def test_the_model_s_state_is_where_mujoco_closes_them(load):
    """Anchors and poses that a file does not give are those of qpos0."""
    model, _, _ = load(
        EQUALITIES["connect"] + EQUALITIES["weld"].replace('"e"', '"w"') + EQUALITIES["connect to the world"].replace('"e"', '"g"')
    )
    assert list(model.loops) == ["e", "w", "g"] and np.abs(model.loops.residual()).max() < 1e-14


def test_a_weld_that_asks_no_rotation_is_a_ball(load):
    """MuJoCo has six rows of it, of which three are zero."""
    model, rows, _ = load('<weld name="e" body1="b" body2="c" anchor=".1 .2 .3" torquescale="0"/>')
    assert model.loops["e"].kind == "ball"
    state = model.assemble(model.random_state(1))
    r, J = rows(state.q)
    assert np.abs(r).max() < 1e-12 and not J[3:].any()
    both = np.linalg.svd(np.vstack([J, model.loops.jacobian(state)]), compute_uv=False)
    assert both[2] > 1e-3 and both[3:].max() < 1e-12


def test_equalities_without_names_are_all_kept(load):
    """Two connects of one pair are a hinge."""
    pair = '<connect body1="b" body2="c" anchor=".1 .2 .3"/><connect body1="b" body2="c" anchor=".5 .2 .3"/>'
    model, rows, _ = load(pair + '<joint joint1="t" joint2="y" polycoef="0 1 0 0 0"/><joint joint1="t" joint2="y" polycoef="0 1 0 .1 0"/>')
    called = ["equality connect of 'b' and 'c'", "equality joint of 't' and 'y'"]
    assert list(model.loops) == [name + more for name in called for more in ("", " (2)")]
    q = model.random_state(1).q
    assert rows(q)[0].shape == model.loops.residual(q).shape == (8,)


def test_what_is_left_out_is_named(load):
    fixed = '<body name="p"><geom size=".1"/></body><body name="o" pos="0 0 1"><geom size=".1"/></body>'
    off = '<connect name="off" body1="a" body2="c" anchor="0 0 0" active="false"/><connect body1="p" body2="o" anchor="0 0 0"/>'
    model, _, said = load(off + EQUALITIES["joint"], WORLD + fixed)
    assert list(model.loops) == ["e"]
    assert said[1].endswith("not active in the file, and left out: equality connect 'off' of 'a' and 'c'")
    assert "equality connect of 'p' and 'o' (loop 'equality connect of" in model.not_read[0]


@pytest.mark.parametrize("flag", ["equality", "constraint"])
def test_equalities_that_a_flag_disables_are_no_loops(tmp_path, flag):
    pytest.importorskip("mujoco")
    path = tmp_path / "scene.xml"
    path.write_text(
        f'<mujoco><option><flag {flag}="disable"/></option><worldbody>{WORLD}</worldbody><equality>{EQUALITIES["weld"]}</equality></mujoco>'
    )
    with pytest.warns(pc.ModelWarning, match="not active in the file, and left out: equality weld 'e' of 'b' and 'c'"):
        model = pc.load(path)
    assert not model.loops and not any("equality" in text for text in model.not_read)
