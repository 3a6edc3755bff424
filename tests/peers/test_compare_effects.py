"""`pc.compare` with MuJoCo beside effects: never one robot where MuJoCo moves otherwise for one, and never another reason than that."""

import warnings

import numpy as np
import pytest

import pycraft as pc
from support.mjcf_attributes import MOVED, NAMED, text_of

EVERY = MOVED | {name: parts for name, (parts, _) in NAMED.items()}
SILENT = ("a muscle", "an orientation servo", "plastic spring", "a motor on a ball", "an asymmetric servo")


@pytest.fixture
def loaded(tmp_path):
    mujoco = pytest.importorskip("mujoco")

    def loaded(parts):
        path = tmp_path / "m.xml"
        path.write_text(text_of(parts))
        try:
            theirs = mujoco.MjModel.from_xml_path(str(path))
        except ValueError:
            pytest.skip("this version of MuJoCo has no such attribute")
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", pc.ModelWarning)
            return pc.load(path, gravity="file"), theirs

    return loaded


@pytest.mark.peers
@pytest.mark.parametrize("name", MOVED)
def test_a_file_beside_itself(loaded, name):
    report = pc.compare(*loaded(MOVED[name]))
    assert report, report
    assert {d.kind for d in report.differences} <= {"free joints"}, report


@pytest.mark.peers
@pytest.mark.parametrize("name", [name for name in NAMED if name not in SILENT])
def test_what_is_not_read_is_no_agreement(loaded, name):
    """Contacts and stops count where they act at a state that is looked at."""
    report = pc.compare(*loaded(NAMED[name][0]), states=10)
    assert not report and all(report.in_common[key] <= report.bounds[key] for key in report.in_common), report
    assert any(NAMED[name][1] in d.text and d.decides for d in report.differences) or "actuator" in {d.kind for d in report.differences}


@pytest.mark.peers
@pytest.mark.parametrize("name", EVERY)
def test_a_plain_model_beside_every_file(loaded, name):
    """If MuJoCo's accelerations differ from the plain file's, the reason named is an effect, and no mass, axis or placement."""
    import mujoco

    if EVERY[name].get("kind", "hinge") != "hinge":
        pytest.skip("another hinge")
    model, plain = loaded({})
    _, theirs = loaded(EVERY[name])
    rng = np.random.default_rng(3)
    apart = False
    for _ in range(5):
        q, v = rng.normal(size=plain.nq), rng.normal(size=plain.nv)
        q[-4:] /= np.linalg.norm(q[-4:])
        found = []
        for m in (plain, theirs):
            d = mujoco.MjData(m)
            d.qpos, d.qvel = q, v
            mujoco.mj_forward(m, d)
            found.append(d.qacc.copy())
        apart |= bool(np.abs(found[0] - found[1]).max() > 1e-9)
    report = pc.compare(model, theirs, states=8)
    blamed = {d.kind for d in report.differences} - {"free joints"}
    if " ref=" not in EVERY[name].get("joint", ""):  # another zero of the angle is another placement of the body
        assert not blamed & {"mass", "centre of mass", "inertia", "geometry"}, report
    if apart:
        excused = {"gravity", "rotor inertia"}  # which the comparison makes the same
        assert not report or blamed & excused, report
        assert blamed
