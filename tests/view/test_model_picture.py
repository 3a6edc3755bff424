"""A model shows itself in a notebook: facts, tree and figure, without a script and with nothing but the package."""

import re
import subprocess
import sys

import numpy as np
import pytest

import pycraft as pc
from pycraft.view.model_picture import LISTED, MOST
from pycraft.view.stick_figure import HINGES


def marks(page):
    """Titles of the figure's marks of hinges, legend left out."""
    return [title.strip() for title in re.findall(r"<title>([^<]*)</title>", page) if ", on " in title]


def test_every_kind_of_hinge_has_a_mark_of_its_own():
    kinds = [kind for kind in HINGES if kind not in ("custom", "weld")]
    model = pc.tree([-1, *range(len(kinds) - 1)], kinds, seed=1)
    page = model._repr_html_()
    assert len(marks(page)) == len(kinds) and all(f">{kind} (1)</text>" in page for kind in kinds)
    assert f"{len(kinds)} bodies; {model.nv} degrees of freedom (nq = {model.nq})" in page
    kept = pc.Multibody("kept", welds="keep")
    kept.add_body("on it", None, "weld", mass=1.0, inertia=np.eye(3))
    assert marks(kept._repr_html_()) == ["on it, on weld on it"]


def test_what_is_said_is_the_model_as_it_stands():
    arm = pc.robots.panda()
    page = arm._repr_html_()
    assert "no gravity" in page and str(arm.tree(LISTED)).splitlines()[2].strip()[:12] in page
    arm.gravity = (0, 0, -9.81)
    straight = page.split("<svg")[1]
    arm.q = arm.random_state(seed=0).q
    moved = arm._repr_html_()
    assert "gravity (0, 0, -9.81) m/s²" in moved and moved.split("<svg")[1] != straight
    bars = pc.chain(3)
    bars.add_loop("body2", hinge="pin", point=(1, 0, 0), name="closure")
    assert "; 1 loop<" in bars._repr_html_()


@pytest.mark.parametrize("model", [pc.Multibody("<nothing>"), pc.chain(1), pc.chain(MOST), pc.chain(MOST + 1)])
def test_from_nothing_to_thousands(model):
    page = model._repr_html_()
    assert ("<svg" in page) == (0 < len(model.bodies) <= MOST) and "nan" not in page and "<script" not in page
    assert "<nothing>" not in page and page.count("<div") == page.count("</div>") and len(page) < 200_000


def test_nothing_but_the_package_is_needed():
    code = (
        "import sys, pycraft as pc; pc.chain(3)._repr_html_(); print([m for m in ('matplotlib', 'scipy', 'IPython') if m in sys.modules])"
    )
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.strip() == "[]"
