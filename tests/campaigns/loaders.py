"""Damaged and hostile model files: a ModelError that names the file, or a model; never an exception of another kind, never a hang.

`python tests/campaigns/loaders.py --seeds 2000`. A round writes a random robot as URDF, MJCF or TOML and damages it: bytes, attributes,
names full of quotes, brackets and escapes, entities, prefixes, numbers that are none, elements moved, doubled and lost.
"""

import sys
import tempfile
import time
import warnings
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))

import pycraft as pc
from campaigns.command_line import listed, seeds

SECONDS = 5.0  # for files of a few hundred bytes
NAMES = [
    "a", "b b", r"\1\g<0>", "(?P<", "'", "[red]", "[/bold]", "%s {0}", "ä", "日本", "a/b", "..", "x" * 300, "hinge 'a'", "body 'b'",
    "*", "-", "0", "a[0]", "&amp;", "&#65;", "root", "world",
]  # fmt: skip
NUMBERS = [
    "0", "1", "-1", "1e-300", "1e308", "1e999", "nan", "inf", "-inf", "1_0", "١", "0x10", "", " ", "1,0", "1 2", "1&nope;0",
    "${x}", "$(x)", "--1", "1e", "true",
]  # fmt: skip
INSERTS = [
    "<!DOCTYPE robot SYSTEM 'x.dtd'>", "<!DOCTYPE robot [<!ENTITY a 'b'>]>", "&nope;", "<foo:bar/>", "<foo:robot>", "</robot>",
    "<link/>", "<joint/>", "<mimic joint='a'/>", "<!--", "]]>", "<![CDATA[", "\x00", "\xff",
    "<?xml version='1.0' encoding='utf-16'?>", "<a:b:c/>", "<inertial/>", "<axis xyz='0 0 0'/>", "<dynamics damping='x'/>",
    "<limit lower='1' upper='-1' effort='inf' velocity='nan'/>", "<origin rpy='1 2'/>", "<pycraft rotor_inertia='-1'/>",
]  # fmt: skip
TOML_INSERTS = [
    "[[bodies]]", "[bodies]", "[[nodes]]", "[state]", "[", "]", "{", "}", '"""', "'''", '"', "'", "#", "\\", "\n", "\r", "=", ",",
    ".a" * 200, "a.b.c = 1\n", "[" * 2000, "\ufeff", "1" * 5000, "nan", "2024-01-01", "true", "\x00", "parent = 'l0'\n",
    "axes = [[0, 0, 1]]\n",
]  # fmt: skip
TOML_KINDS = ["pin", "slider", "screw", "universal", "ball", "free", "weld", "planar", "custom"]
MOMENTS = {"ixx": 1, "ixy": 0, "ixz": 0, "iyy": 1, "iyz": 0, "izz": 1}
KINDS = ["revolute", "continuous", "prismatic", "fixed", "floating", "planar", "ball", "spherical", "knee"]


def urdf(rng):
    """A URDF file, mostly right."""
    n = int(rng.integers(1, 6))
    odd = lambda usual, strange, p: str(rng.choice(strange)) if rng.random() < p else usual
    number = lambda x: odd(str(x), NUMBERS, 0.02)
    names = [odd(f"l{k}", NAMES, 0.15) for k in range(n)]
    quoted = [name.replace("<", "&lt;").replace('"', "&quot;") for name in names]
    lines = [f'<robot name="{odd("r", NAMES, 0.1)}">'.replace("<(", "(")]
    for name in quoted:
        moments = " ".join(
            f'{m}="{number(v)}"' for m, v in zip(("ixx", "ixy", "ixz", "iyy", "iyz", "izz"), (1, 0, 0, 1, 0, 1), strict=True)
        )
        lines.append(f'<link name="{name}"><inertial><mass value="{number(1)}"/><inertia {moments}/></inertial></link>')
    for k in range(1, n):
        parent = quoted[int(rng.integers(n)) if rng.random() < 0.05 else int(rng.integers(k))]
        mimic = f'<mimic joint="{odd(f"j{k - 1}", NAMES, 0.1)}"/>' if rng.random() < 0.05 else ""
        lines.append(
            f'<joint name="{odd(f"j{k}", NAMES, 0.15)}" type="{rng.choice(KINDS)}"><parent link="{parent}"/><child link="{quoted[k]}"/>'
            f'<origin xyz="{number(0)} 0 1" rpy="0 {number(0)} 0"/><axis xyz="0 0 {number(1)}"/>'
            f'<limit lower="{number(-1)}" upper="1"/>{mimic}</joint>'
        )
    return "\n".join([*lines, "</robot>"])


def mjcf(rng):
    """An MJCF file, mostly right."""
    name = lambda usual: str(rng.choice(NAMES)).replace("<", "&lt;").replace('"', "&quot;") if rng.random() < 0.2 else usual
    joints = "".join(
        f'<joint name="{name(f"j{i}")}" type="{rng.choice(["hinge", "slide", "ball", "free"])}"/>' for i in range(int(rng.integers(3)))
    )
    size = rng.choice(NUMBERS) if rng.random() < 0.2 else "1"
    return f'<mujoco model="{name("m")}"><worldbody><body name="{name("b")}">{joints}<geom size="{size}"/></body></worldbody></mujoco>'


def toml(rng):
    """A TOML file, mostly right."""
    odd = lambda usual, strange, p: str(rng.choice(strange)) if rng.random() < p else usual
    word = lambda usual: '"' + odd(usual, NAMES, 0.03).replace('"', "'").replace("\\", "/") + '"'
    number = lambda x: odd(str(x), NUMBERS, 0.01)
    vector = lambda *x: f"[{', '.join(map(number, x))}]"
    lines = [f"name = {word('r')}", f"gravity = {vector(0, 0, -9.81)}"]
    for k in range(int(rng.integers(1, 5))):
        kind = str(rng.choice(TOML_KINDS))
        lines += ["[[bodies]]", f"name = {word(f'l{k}')}", f'hinge = "{kind}"']
        lines += [f"parent = {word(f'l{int(rng.integers(k))}')}"] if k else []
        lines += [f"position = {vector(0, 0, 1)}", f"rpy = {vector(0, 1, 0)}", f"mass = {number(1)}"]
        lines += [f"limits = {vector(-1, 1)}"] if kind in ("pin", "slider", "screw") else []
        if kind == "custom":
            lines += [f"subhinges = [{{ kind = {word('pin')} }},\n  {{ kind = {word('ball')}, point = {vector(0, 0, 1)} }}]"]
        lines += [f"inertia = {{ xx = {number(1)}, yy = 1, zz = {number(1)} }}"]
    return "\n".join([*lines, "[[nodes]]", f"name = {word('n')}", f"body = {word('l0')}", "[state.q]"])


def damaged(rng, text, inserts=INSERTS):
    """The bytes of a file, most of them left as they are."""
    for _ in range(int(rng.integers(0, 3))):
        at = int(rng.integers(len(text) + 1))
        kind = int(rng.integers(4))
        length = int(rng.integers(1, 30))
        if kind == 0:
            text = text[:at] + str(rng.choice(inserts)) + text[at:]
        elif kind == 1:
            text = text[:at] + text[at + length :]
        elif kind == 2:
            text = text[:at] + text[at : at + length] + text[at:]
        else:
            text = text[:at] + chr(int(rng.integers(1, 500))) + text[at + 1 :]
    return text.encode("latin-1" if rng.random() < 0.1 else "utf-8", errors="replace")


def one_round(seed, folder):
    """None, or what is wrong with the reading of one file."""
    rng = np.random.default_rng(seed)
    kind = rng.random()
    xml, tables = kind < 0.25, kind > 0.75
    path = Path(folder) / ("robot.toml" if tables else "robot.xml")
    if tables:
        path.write_bytes(damaged(rng, toml(rng), TOML_INSERTS))
    else:
        path.write_bytes(damaged(rng, mjcf(rng) if xml else urdf(rng)))
    options = {"mimic": str(rng.choice(["couple", "refuse", "lock", "free"])), "welds": str(rng.choice(["lump", "keep"]))}
    if not (xml or tables):
        options["root"] = str(rng.choice(["fixed", "free"]))
    begin = time.perf_counter()
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", pc.ModelWarning)
            model = pc.load(path, **options)
            model.random_state(0)
            model.mass_matrix(model.q)
    except pc.Error as error:
        if isinstance(error, pc.ModelError) and str(path) not in str(error):
            return f"seed {seed}: the file is not named: {error}"
    except Exception as error:
        return f"seed {seed}: {type(error).__name__}: {str(error)[:200]}"
    seconds = time.perf_counter() - begin
    return f"seed {seed}: {seconds:.1f} s" if seconds > SECONDS else None


def run(seeds):
    """Return the errors, one line each."""
    with tempfile.TemporaryDirectory() as folder:
        return [text for seed in seeds if (text := one_round(seed, folder))]


if __name__ == "__main__":
    sys.exit(listed(run(seeds(__doc__, 2000, first=False))))
