"""Names of other packages: the table behind errors, and its page."""

import importlib
import re

import numpy as np
import pytest

import pycraft as pc
from making.coming_from import PAGE, table
from pycraft.other_names import rows

ROWS = rows()


def test_the_page_has_the_table():
    """`PYTHONPATH=docs python -m making.coming_from` writes it anew."""
    assert table() in PAGE.read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def owners():
    arm = pc.chain(2)
    scene = pc.Scene(arm)
    return {"Multibody": arm, "Scene": scene, "Run": scene.simulate(0.1, progress=False), "pycraft": pc}


@pytest.mark.parametrize("row", ROWS, ids=lambda row: f"{row.of}: {row.what}")
def test_what_a_row_names_here_is_here(owners, row):
    for name in re.findall(r"(?:^|, )(?:pc\.)?([a-z_]\w*|Scene|Multibody)", re.sub(r"\([^)]*\)|\[[^]]*\]", "", row.here)):
        assert hasattr(owners[row.of], name), name


@pytest.mark.parametrize("row", ROWS, ids=lambda row: f"{row.of}: {row.what}")
def test_names_elsewhere_answer_with_the_name_here(owners, row):
    asked = [name for name in row.asked() if not hasattr(owners[row.of], name)]
    for name in asked:
        with pytest.raises(AttributeError, match=re.escape(f"has no attribute {name!r}; here that is ")) as error:
            getattr(owners[row.of], name)
        assert error.value.name == name


def test_a_newcomer_s_first_ten(owners):
    said = {"fk": "pose(", "aba": "forward_dynamics(", "rnea": "inverse_dynamics(", "crba": "mass_matrix(", "nle": "bias_forces("}
    said |= {"joints": "hinges", "links": "bodies", "com": "centre_of_mass(", "n": "nv", "ik": "solve_ik("}
    for name, here in said.items():
        with pytest.raises(AttributeError, match=re.escape(f"here that is model.{here}")):
            getattr(owners["Multibody"], name)
        assert not hasattr(owners["Multibody"], name)


def test_other_names_are_plainly_missing(owners):
    for owner in owners.values():
        with pytest.raises(AttributeError, match=r"'zebra'$"):
            getattr(owner, "zebra")  # noqa: B009 - the message is what is tested
        with pytest.raises(AttributeError, match=r"'__array_interface__'$|'_joints'$"):
            getattr(owner, "_joints")  # noqa: B009 - the message is what is tested


def test_what_is_there_is_found_as_before():
    arm = pc.chain(2)
    assert np.allclose(arm.q, 0) and arm.nv == 2 and hasattr(arm, "soa")


@pytest.mark.peers
@pytest.mark.parametrize("which, module", [(0, "pinocchio"), (1, "mujoco")])
def test_the_names_are_theirs(which, module):
    """Of the packages that can be asked: every name is somewhere in the module or in one of its classes."""
    package = importlib.import_module(module)
    known = set(dir(package)) | {name for each in vars(package).values() if isinstance(each, type) for name in dir(each)}
    known |= set(dir(importlib.import_module(f"{module}.{('visualize', 'viewer')[which]}"))) | {"example_robot_data"}
    for row in ROWS:
        for name in filter(None, (each.strip().rpartition(".")[2] for each in row.names[which].split(","))):
            assert name in known, f"{row.what}: {name}"
