"""Whatever of an MJCF file changes accelerations in MuJoCo is in the model, offered as an effect, or named.

One file for each option, flag and attribute, alone and in pairs: where MuJoCo's accelerations are not those of a scene with all offered
effects, `from_model(...).notes` names the reason, and where nothing is named they agree to rounding. The list of MuJoCo's fields is
complete for the version that is installed.
"""

import itertools
import warnings

import numpy as np
import pytest

import pycraft as pc
from pycraft.interop import mujoco as conventions
from support.mjcf_attributes import MOVED, NAMED, text_of


@pytest.fixture
def mujoco():
    return pytest.importorskip("mujoco")


def acceleration_pairs(mujoco, path, seed=0):
    """MuJoCo's accelerations and ours with every offered effect, and what is not offered."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", pc.ModelWarning)
        model = pc.load(path, gravity="file")
    m = mujoco.MjModel.from_xml_path(str(path))
    d = mujoco.MjData(m)
    scene, offered = pc.Scene(model), pc.effects.from_model(model)
    for k, effect in enumerate(offered):
        scene.add(effect, name=f"effect{k}")
    state = model.random_state(seed)
    d.qpos, d.qvel = conventions.to_mujoco(model, state.q, state.v)
    mujoco.mj_forward(m, d)
    ours = conventions.acceleration_to_mujoco(model, state.q, state.v, scene.evaluate(state.q, state.v).vdot)
    return d.qacc.copy(), ours, offered.notes


def written(mujoco, tmp_path, parts):
    path = tmp_path / "m.xml"
    path.write_text(text_of(parts))
    try:
        mujoco.MjModel.from_xml_path(str(path))
    except ValueError as error:
        assert "unrecognized attribute" in str(error) or "unrecognized element" in str(error) or "Schema violation" in str(error), error
        pytest.skip("this version of MuJoCo has no such attribute")
    return path


def agrees(theirs, ours):
    """To rounding: sums of some tens of products on both sides, solved with a matrix of condition below 1e4."""
    return np.abs(theirs - ours).max() <= 1e-10 * (1 + np.abs(theirs).max())


@pytest.mark.peers
@pytest.mark.parametrize("name", MOVED)
def test_what_acts_is_taken(mujoco, tmp_path, name):
    for seed in range(3):
        theirs, ours, notes = acceleration_pairs(mujoco, written(mujoco, tmp_path, MOVED[name]), seed)
        assert notes == [] and agrees(theirs, ours), (theirs, ours, notes)


@pytest.mark.peers
@pytest.mark.parametrize("name", NAMED)
def test_what_is_not_taken_is_named(mujoco, tmp_path, name):
    parts, said = NAMED[name]
    path = written(mujoco, tmp_path, parts)
    notes = acceleration_pairs(mujoco, path)[2]
    assert any(said in note for note in notes), notes
    with pytest.warns(pc.ModelWarning) as caught:
        pc.load(path)
    assert any(said in str(warning.message) for warning in caught) or "symmetric" in said


@pytest.mark.peers
def test_every_attribute_that_is_named_acts(mujoco, tmp_path):
    """The list of `NAMED` holds nothing that changes nothing: at some state MuJoCo's accelerations are other ones without it."""
    for name, (parts, _) in NAMED.items():
        path = tmp_path / "m.xml"
        path.write_text(text_of(parts))
        try:
            mujoco.MjModel.from_xml_path(str(path))
        except ValueError:
            continue
        apart = [not agrees(*acceleration_pairs(mujoco, path, seed)[:2]) for seed in range(8)]
        latent = name in ("a muscle", "an orientation servo", "plastic spring", "a rotor on a ball")  # at control zero; once it yields
        assert any(apart) or latent, name


@pytest.mark.peers
def test_pairs_of_attributes(mujoco, tmp_path):
    """In pairs, drawn from a seed: agreement, or a name."""
    rng = np.random.default_rng(7)
    everything = MOVED | {name: parts for name, (parts, _) in NAMED.items()}
    pairs = [pair for pair in itertools.combinations(everything, 2) if not set(everything[pair[0]]) & set(everything[pair[1]])]
    tried = 0
    for k in rng.permutation(len(pairs))[:150]:
        path = tmp_path / "m.xml"
        path.write_text(text_of(everything[pairs[k][0]] | everything[pairs[k][1]]))
        try:
            mujoco.MjModel.from_xml_path(str(path))
        except ValueError:
            continue
        theirs, ours, notes = acceleration_pairs(mujoco, path, int(k))
        tried += 1
        assert notes or agrees(theirs, ours), (pairs[k], theirs, ours)
    assert tried > 100


# The list of MuJoCo's fields ------------------------------------------------------------------------------------------

KNOWN = {
    "opt": "density disableactuator disableflags enableflags gravity viscosity wind",
    "body": "parentid rootid weldid mocapid jntnum jntadr dofnum dofadr treeid geomnum geomadr simple sameframe pos quat ipos iquat "
    "mass subtreemass "
    "inertia invweight0 gravcomp margin user plugin contype conaffinity bvhadr bvhnum",
    "jnt": "type qposadr dofadr bodyid actuatorid group plasticadr limited actfrclimited actgravcomp solref solimp pos axis "
    "stiffness stiffnesspoly "
    "springyield range actfrcrange margin user",
    "dof": "bodyid jntid parentid treeid Madr simplenum solref solimp frictionloss armature damping dampingpoly invweight0 M0 length",
    "tendon": "type adr num matid actuatorid group plasticadr treenum treeid limited actfrclimited width solref_lim solimp_lim "
    "solref_fri solimp_fri "
    "range actfrcrange margin stiffness stiffnesspoly damping dampingpoly armature frictionloss lengthspring springyield "
    "length0 invweight0 user rgba",
    "actuator": "trntype dyntype gaintype biastype ctrladr ctrlnum ctrlspec outadr outnum actadr actnum trnid cranklength dynprm gainprm "
    "biasprm "
    "actlimited actrange actearly history historyadr delay damping dampingpoly armature group user plugin forcelimited "
    "forcerange ctrllimited "
    "ctrlrange gear acc0 length0 lengthrange",
    "eq": "type obj1id obj2id objtype active0 solref solimp data",
    "flg": "gravcomp surfacevel adhesion",
}
"""Fields that were looked at, by their beginnings: each is read, offered, named, or changes no motion (places, numbers for drawing and for
solvers).
Those of contacts (geom, pair, exclude), flexes and plugins are named as a whole."""
SOLVERS = (
    "timestep impratio tolerance ls_tolerance noslip_tolerance ccd_tolerance sleep_tolerance magnetic o_margin o_solref "
    "o_solimp o_friction integrator "
    "cone jacobian solver iterations ls_iterations noslip_iterations ccd_iterations sdf_initpoints sdf_iterations apirate"
)


@pytest.mark.peers
def test_every_field_of_mujoco_was_looked_at(mujoco):
    if tuple(map(int, mujoco.__version__.split(".")[:2])) > (4, 0):
        pytest.skip("a newer MuJoCo than the one whose fields were looked at")
    m = mujoco.MjModel.from_xml_string("<mujoco/>")
    options = {name for name in dir(m.opt) if not name.startswith("_")}
    assert options <= set((KNOWN["opt"] + " " + SOLVERS).split()), options - set((KNOWN["opt"] + " " + SOLVERS).split())
    for beginning in set(KNOWN) - {"opt"}:
        own = {name.removeprefix(beginning + "_") for name in dir(m) if name.startswith(beginning + "_")}
        assert own <= set(KNOWN[beginning].split()), (beginning, own - set(KNOWN[beginning].split()))
    flags = {name.removeprefix("mjDSBL_").lower() for name in mujoco.mjtDisableBit.__members__ if name.startswith("mjDSBL_")}
    acting = {
        "constraint",
        "equality",
        "frictionloss",
        "limit",
        "contact",
        "spring",
        "damper",
        "gravity",
        "clampctrl",
        "filterparent",
        "actuation",
    }
    solving = {"warmstart", "refsafe", "sensor", "midphase", "eulerdamp", "autoreset", "nativeccd", "island", "multiccd"}
    assert flags <= acting | solving, flags - acting - solving
