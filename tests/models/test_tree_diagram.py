"""The tree of a model as text: every body with the one that carries it, within 80 columns."""

import random
import re

import pytest

import pycraft as pc
from support.mechanisms import every_kind


def shown(model, **options):
    lines = str(model.tree(**options)).split("\n")
    assert all(len(line) <= 80 and line == line.rstrip() for line in lines)
    return lines


def test_an_arm():
    assert str(pc.robots.panda().tree(nodes=True)) == PANDA


PANDA = """\
panda: 7 bodies, 7 degrees of freedom, 2 nodes
base
├─ panda_link0                       node
└─ panda_link1                       pin   panda_joint1  q[0]
   └─ panda_link2                    pin   panda_joint2  q[1]
      └─ panda_link3                 pin   panda_joint3  q[2]
         └─ panda_link4              pin   panda_joint4  q[3]
            └─ panda_link5           pin   panda_joint5  q[4]
               └─ panda_link6        pin   panda_joint6  q[5]
                  └─ panda_link7     pin   panda_joint7  q[6]
                     └─ panda_link8  node"""


def test_branches():
    """Lines go down to the last of a body's children, beside those of its others."""
    drawn = [re.split(r"  +(?=pin)", line)[0] for line in shown(pc.tree([-1, 0, 1, 1, 0, 4, -1], "pin"))]
    assert drawn[2:] == ["├─ body0", "│  ├─ body1", "│  │  ├─ body2", "│  │  └─ body3", "│  └─ body4", "│     └─ body5", "└─ body6"]


def test_every_kind_and_its_coordinates():
    model = every_kind()
    for line in shown(model)[2:]:
        name, kind, hinge, *places = re.sub("[│├└─]", " ", line).split()
        assert model.bodies[name].hinge.name == hinge and model.hinges[hinge].kind == kind
        q, v = model.hinges[hinge].q_slice, model.hinges[hinge].v_slice
        one = lambda part: f"[{part.start}]" if part.stop == part.start + 1 else f"[{part.start}:{part.stop}]"
        assert places == ([f"q{one(q)}", f"v{one(v)}"] if v.stop > v.start else [])


def carriers(lines, step):
    """By name, the body that carries a body, as a reader finds it: connectors show siblings; without one, the line above carries."""
    found, levels = {}, [(-1, "base")]
    above = "base"
    for line in lines:
        before, name = re.match(r"([ │├└─]*)(\S+)", line).groups()
        if re.search("[├└]", before):
            level = (len(before) - step) // step
            while levels[-1][0] >= level:
                levels.pop()
            found[name] = levels[-1][1]
            levels.append((level, name))
        else:
            found[name] = above
            level = len(before) // step - 1
            while levels[-1][0] > level:
                levels.pop()
            levels[-1] = (level, name)
        above = name
    return found


@pytest.mark.parametrize("seed", range(40))
def test_a_reader_finds_what_carries_what(seed):
    rng = random.Random(seed)
    n = rng.choice([1, 2, 5, 12, 20])
    parents = [rng.choice([-1, *range(max(0, k - rng.choice([1, 2, 9])), k)]) if k else -1 for k in range(n)]
    model = pc.tree(parents, "pin")
    lines = shown(model)
    folded = lines[1].startswith("(an only child")
    assert lines[1 + folded] == "base"
    expected = {name: body.parent.name if body.parent else "base" for name, body in model.bodies.items()}
    found = carriers(lines[2 + folded :], 3)
    if "⋯" not in "".join(lines):
        assert found == expected


def test_long_chains_stay_at_the_margin():
    lines = shown(pc.chain(30))
    assert lines[1:4] == ["(an only child stands below the body that carries it)", "base", "body0   pin  hinge0   q[0]"]
    assert lines[-1] == "body29  pin  hinge29  q[29]" and len(lines) == 33


def test_long_trees_are_abbreviated():
    model = pc.chain(1000)
    lines = shown(model, most=30)
    assert len(lines) == 3 + 30 + 1 and "⋮  970 more; tree(most=None) shows all" in lines
    assert lines[3].startswith("body0 ") and lines[-1].startswith("body999 ")
    assert len(shown(model)) == 204 and len(shown(model, most=None)) == 1003 and len(shown(model, most=1)) == 5
    assert "more" not in "".join(shown(pc.chain(200)))


def test_deep_branches_and_long_names_fit():
    parents = [-1]
    for k in range(30):
        parents += [2 * k, 2 * k]
    assert any(re.match(r" +⋯13[├└]─ body", line) for line in shown(pc.tree(parents, "ball")))
    model = pc.Multibody("m" * 100)
    model.add_body("b" * 100, mass=1, hinge_name="h" * 100)
    lines = shown(model)
    assert lines[0].endswith("m…") and "b…" in lines[2] and lines[2].endswith("q[0]")
    robot = shown(pc.robots.g1())
    assert "        ├ left_shoulder_pitch_link          pin   q[22] v[21]" in robot and not any("…" in line for line in robot)


def test_small_ones():
    assert shown(pc.Multibody("empty")) == ["empty: 0 bodies, 0 degrees of freedom", "base"]
    model = pc.Multibody("one")
    model.add_body("line\nbreak", mass=1)
    assert shown(model) == ["one: 1 body, 1 degree of freedom", "base", "└─ line\\nbreak  pin  q[0]"]
    assert repr(model.tree()) == str(model.tree())
    with pytest.raises(pc.ModelError, match="the most lines of a tree must be a whole number, not 2.5"):
        model.tree(2.5)
