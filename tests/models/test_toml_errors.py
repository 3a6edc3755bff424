"""TOML files that are wrong: an error of ours that says file, line, table, key and remedy, for whatever can be wrong, hostile files too."""

import time

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import pycraft as pc
from pycraft.models.loaders.toml_file import TomlFile
from pycraft.models.loaders.toml_lines import lines_of, statements

A = '[[bodies]]\nname = "a"\n'
SUBHINGES = 'hinge = "custom"\nsubhinges = [\n  { kind = "pin" }, # {\n\n  '
THREE = "write three finite numbers: [x, y, z]"


@pytest.fixture
def says(tmp_path):
    """Return the error of loading a text, without the path."""

    def refused(text, **options):
        path = tmp_path / "m.toml"
        path.write_bytes(text if isinstance(text, bytes) else text.encode())
        begin = time.perf_counter()
        with pytest.raises(pc.ModelError) as caught:
            pc.load(path, **options)
        assert time.perf_counter() - begin < 20 and str(caught.value).startswith(str(path))
        return str(caught.value).removeprefix(str(path)).replace(str(path), "m.toml")

    return refused


@pytest.mark.parametrize(
    ("text", "message"),
    [
        # keys
        ('nam = "x"', ":1: a model has no key 'nam'; did you mean 'name'?"),
        (A + "\n# mass\nMASS = 1", ":5: body 'a' has no key 'MASS'; did you mean 'mass'?"),
        (A + "zzz = 1", ":3: body 'a' has no key 'zzz'; there are name, parent, hinge, hinge_name, axis, axes, point, pitch, subhinges, "
         "position, rotation, rpy, quaternion, limits, rotor_inertia, mass, com, inertia"),
        ('[[nodes]]\nname = "n"\nparent = "a"',
         ":3: node 'n' has no key 'parent'; there are name, body, position, rotation, rpy, quaternion"),
        (A + "inertia = { xx = 1, xyz = 2 }", ":3: body 'a': inertia has no key 'xyz'; did you mean 'yz'?"),
        (A + SUBHINGES + '{ kind = "pin", axes = [0, 0, 1] }]', ":7: body 'a': subhinge 1 has no key 'axes'; did you mean 'axis'?"),
        (A + "[state]\nu = 1", ":4: the state has no key 'u'; there are q, v"),
        (A + "[left_aside]\ndampng = 1", ":4: left_aside has no key 'dampng'; did you mean 'damping'?"),
        ("format = 2", ":1: format = 2 is not read by this version of pycraft, which reads 1"),
        # types
        ("name = 3", ':1: a model: name = 3; write a name in quotes: "..."'),
        ("strict = 1", ":1: a model: strict = 1; write true or false"),
        ('welds = "lumped"', ":1: a model: welds = 'lumped'; did you mean 'lump'?"),
        ("welds = [1]", ":1: a model: welds = [1]; there are lump, keep"),
        ("gravity = -9.81", f":1: a model: gravity = -9.81; {THREE} in m/s²"),
        ("gravity = [0, 0, nan]", f":1: a model: gravity = [0, 0, nan]; {THREE} in m/s²"),
        ("gravity = [0, true, 1]", f":1: a model: gravity = [0, True, 1]; {THREE} in m/s²"),
        ("bodies = 3", ":1: a model: bodies = 3; write a list of tables: [[bodies]]"),
        ('[bodies]\nname = "a"', ":1: a model: bodies is a table; write a list of tables: [[bodies]]"),
        ("bodies = [1]", ":1: body number 1 is a table, not 1"),
        (A + 'mass = "1"', ":3: body 'a': mass = '1'; write a finite number, in kg"),
        (A + "mass = true", ":3: body 'a': mass = true; write a finite number, in kg"),
        (A + "mass = nan", ":3: body 'a': mass = nan; write a finite number, in kg"),
        (A + "mass = 1979-05-27", ":3: body 'a': mass = 1979-05-27; write a finite number, in kg"),
        (A + f"mass = 1{'0' * 400}", f":3: body 'a': mass = 1{'0' * 56}...; write a finite number, in kg"),
        (A + f"mass = 0x{'f' * 5000}", ":3: body 'a': mass = a number of too many digits; write a finite number, in kg"),
        (A + f"mass = 1{'0' * 5000}", ":3: not well-formed TOML: a whole number of thousands of digits"),
        (A + "com = [0, 1]", f":3: body 'a': com = [0, 1]; {THREE} in m, in the body's frame"),
        (A + 'com = [0, "1", 2]', f":3: body 'a': com = [0, '1', 2]; {THREE} in m, in the body's frame"),
        (A + "inertia = [1, 2, 3]", ":3: body 'a': inertia is a table, not [1, 2, 3]"),
        (A + "[bodies.inertia]\nxx = 1\nxy = '1'", ":5: body 'a': inertia: xy = '1'; write a finite number, in kg m²"),
        (A + "rotation = [[1, 0, 0], [0, 1, 0]]",
         ":3: body 'a': rotation = [[1, 0, 0], [0, 1, 0]]; write three rows of three finite numbers: "
         "[[1, 0, 0], [0, 1, 0], [0, 0, 1]]"),
        (A + "rotor_inertia = []", ":3: body 'a': rotor_inertia = []; write a number, or one for each coordinate: [0.1, 0.2]"),
        (A + "limits = [-1, nan]",
         ":3: body 'a': limits = [-1, nan]; write [lower, upper], or [[lower, ...], [upper, ...]] with one of each "
         "a subhinge; -inf and inf are no limit"),
        (A + "[state.q]\na = nan", ":4: q of the state: a = nan; write a finite number, the value of the hinge's coordinate"),
        (A + 'hinge = "ball"\n[state.v]\na = [0, 0]', ":5: v of the state: a = [0, 0]; write 3 finite numbers, those of a ball hinge"),
        (A + "[left_aside]\ndamping = 1", ":4: damping in left_aside is a table, not 1"),
        # what does not go together
        ("[[bodies]]\nmass = 1", ':1: body number 1 has no name; give it one: name = "..."'),
        (A + "axis = [0, 0, 1]\naxes = [[0, 0, 1]]", ":4: body 'a': give axis or axes, not both"),
        (A + "rpy = [0, 0, 1]\nquaternion = [1, 0, 0, 0]", ":4: body 'a' has rpy and quaternion; give one of them"),
        (A + "quaternion = [0, 0, 0, 0]", ":3: body 'a': quaternion has zero length; the identity is [1, 0, 0, 0]"),
        (A + 'hinge = "custom"', ':3: body \'a\': a custom hinge has subhinges = [{kind = "pin", axis = [0, 0, 1]}, ...]'),
        (A + SUBHINGES + '{ axis = [0, 0, 1] },\n]', ':7: body \'a\': subhinge 1 has no kind; give it one: kind = "pin"'),
        (A + "point = [1, 0, 0]\n" + SUBHINGES + "]", ":3: body 'a' has subhinges and point; each subhinge has its own"),
        (A + SUBHINGES + '{ kind = "pim" }]', ":7: body 'a': subhinge 1: kind = 'pim'; did you mean 'pin'?"),
        (A + 'subhinges = [{ kind = "slider" }]',
         ":3: hinge 'a' of kind 'pin' has the subhinges pin, not slider; a hinge of your own is of "
         "kind 'custom'"),
        (A + 'hinge = "pim"', ":3: body 'a': hinge = 'pim'; did you mean 'pin'?"),
        (A + 'hinge = "universal"\naxes = [[1, 0, 0]]', ":4: hinge 'a' of kind 'universal' takes 2 axes, not 1"),
        # what the core refuses, at the key that says it
        (A + "mass = -1", ":3: body 'a': its mass is -1 kg; a mass is not negative"),
        (A + "mass = 1\ninertia = { xx = -1 }",
         ":4: body 'a': its inertia has the principal moment -1 kg m²; an inertia is positive semidefinite"),
        (A + "axis = [0, 0, 0]", ":3: hinge 'a': its axis has length 0.000000; give a direction"),
        (A + "pitch = 1", ":3: hinge 'a' of kind 'pin' has no pitch; leave it out"),
        (A + "rotor_inertia = -1", ":3: hinge 'a': rotor inertia -1 is not a nonnegative number"),
        (A + "limits = [1, -1]", ":3: hinge 'a': limits (1, -1) are the wrong way round; give (lower, upper)"),
        (A + "rotation = [[1, 0, 0], [0, 1, 0], [0, 0, -1]]",
         ":3: the rotation of the placement of hinge 'a' is a reflection; its columns are "
         "a right-handed frame"),
        (A + 'hinge = "ball"\n[state.q]\na = [0, 0, 0, 0]',
         ":5: q of hinge 'a': its quaternion has length 0 and no direction; (1, 0, 0, 0) is "
         "no rotation"),
        # names
        (A + "\n" + A, ":5: body 'a': body 'a', m.toml:2, has this name already; rename one"),
        (A + '[[nodes]]\nname = "a"', ":4: node 'a': body 'a', m.toml:2, has this name already; rename one"),
        (A + '[[bodies]]\nname = "b"\nhinge_name = "a"', ":5: 'm' has a hinge called 'a' already; give every hinge a name of its own"),
        (A + 'parent = "b"', ":3: body 'a' is on 'b', and no body or node has this name; there are a"),
        (A + '[[bodies]]\nname = "arm"\nparent = "ar"',
         ":5: body 'arm' is on 'ar', and no body or node has this name; did you mean 'arm'?"),
        (A + "[state.q]\nb = 1", ":4: q of the state: no hinge is called 'b'; there are a"),
        (A + '[[actuators]]\nname = "m"',
         ":3: actuator 'm' acts on no coordinate; name one: coordinate = \"...\", or say in why_not why there is none"),
        (A + '[[actuators]]\nname = "m"\ncoordinate = "b"', ":5: actuator 'm': no coordinate is called 'b'; there are a"),
        (A + '[[actuators]]\nname = "m"\ncoordinate = "a"\nforce_range = 3',
         ":6: actuator 'm': force_range = 3; write two forces in N m or N: [lower, upper]"),
        (A + "[left_aside.spring_rest]\nb = 1", ":4: spring_rest in left_aside: no hinge is called 'b'; there are a"),
        (A + "[left_aside.damping]\nb = 1", ":4: damping in left_aside: no coordinate is called 'b'; there are a"),
        (
            A + 'parent = "b"\n[[bodies]]\nname = "b"\nparent = "a"\n[[bodies]]\nname = "c"\nparent = "a"',
            ":3: a → b → a carry each other; a model is a tree: leave one parent out",
        ),
        ('[[nodes]]\nname = "n"\nbody = "n"', ":3: n → n carry each other; a model is a tree: leave one parent out"),
        # no TOML
        ("a = ", ":1: not well-formed TOML: Invalid value (at the end)"),
        (A + "mass = 1\nmass = 2\n", ":4: not well-formed TOML: Cannot overwrite a value (column 9)"),
        ("[state]\n[state]", ":2: not well-formed TOML: Cannot declare ('state',) twice (column 7)"),
        (A + "x = 1\n[bodies]\n", ":4: not well-formed TOML: Cannot declare ('bodies',) twice (column 8)"),
        ("<robot/>", ":1: not well-formed TOML: Invalid statement (column 1)"),
        (b"name = 'a'\n# \xe4\n", ":2: a byte that is not UTF-8 (invalid continuation byte); save the file in UTF-8"),
        ("name = 'a'".encode("utf-16"), ":1: a byte that is not UTF-8 (invalid start byte); save the file in UTF-8"),
        ("\x00", ":1: not well-formed TOML: Invalid statement (column 1)"),
        (f"a = {'[' * 100_000}", ": lists or tables within each other, too deep to be read"),
        (f"a = {'{a = ' * 100_000}", ": lists or tables within each other, too deep to be read"),
        (f"{'a.' * 100_000}a = 1", ":1: a key of 100001 parts; 100 are read at most"),
        ("\n[" + '"a" . ' * 100_000 + "a]", ":2: a key of 100001 parts; 100 are read at most"),
    ],
)  # fmt: skip
def test_what_is_said(says, text, message):
    assert says(text) == message


def test_names_that_look_like_something_else(says):
    """Words of an error that stand in a name do not say which key is at fault."""
    for name in ("its mass", "limit", "rotor inertia", "axis", "subhinge"):
        text = f'[[bodies]]\nname = "{name}"\nmass = 1\nlimits = [0, 1]\nrotor_inertia = 1\naxis = [0, 0, 1]\ninertia = {{ xx = -1 }}'
        assert says(text).startswith(":7: "), name


def test_options_that_are_for_other_files(says):
    assert says(A, root="free") == ':1: root="free" is for URDF files; in a TOML file give the body hinge = "free" and hinge_name = "root"'


def test_paths(tmp_path):
    with pytest.raises(pc.ModelError, match=r"nowhere\.toml: cannot be read: No such file"):
        pc.load(tmp_path / "nowhere.toml")
    (tmp_path / "folder.toml").mkdir()
    with pytest.raises(pc.ModelError, match="cannot be read: Is a directory"):
        pc.load(tmp_path / "folder.toml")
    with pytest.raises(pc.ModelError, match="embedded null"):
        pc.load(b"a\x00.toml")


def test_many_dots_that_are_no_key(tmp_path):
    (tmp_path / "m.toml").write_text(f'name = "{"." * 200}" # {"." * 200}\n')
    assert pc.load(tmp_path / "m.toml").name == "." * 200


# Lines ----------------------------------------------------------------------------------------------------------------

TEXT = '''\
# head = 0
title = "a # b [[x]]"   # [[y]]
"quoted.key" = {a.b = 1, c = [1,
  2]}
many = """
x = 1
\\"""still"""""
raw = \'\'\'
y = 2 \\\'\'\'
list = [ # [
  # a comment, with ] and "
  1, [2,
  3],

  {k = "]"},
]
[a."b.c".d]  # table
e.f = 3
[[t]]
u = 1
[[t.s]]
[[t.s]]
w = 1
[[t]]
[t.v]
x = 2\
'''


def test_the_lines_of_everything():
    lines = lines_of(TEXT)
    assert lines == {
        ("title",): 2, ("quoted.key",): 3, ("quoted.key", "a"): 3, ("quoted.key", "c"): 3, ("many",): 5, ("raw",): 8, ("list",): 10,
        ("list", 0): 12, ("list", 1): 12, ("list", 2): 15, ("a",): 17, ("a", "b.c"): 17, ("a", "b.c", "d"): 17,
        ("a", "b.c", "d", "e"): 18, ("a", "b.c", "d", "e", "f"): 18, ("t",): 19, ("t", 0): 19, ("t", 0, "u"): 20, ("t", 0, "s"): 21,
        ("t", 0, "s", 0): 21, ("t", 0, "s", 1): 22, ("t", 0, "s", 1, "w"): 23, ("t", 1): 24, ("t", 1, "v"): 25, ("t", 1, "v", "x"): 26,
    }  # fmt: skip


PIECES = [
    "a = 1",
    'b = "#"',
    "c = [1,\n2]",
    "[d]",
    "[[e]]",
    "# c",
    "",
    'f = """\n[g]\n"""',
    "h = {i = 1}",
    "j = '''\n\n'''",
    'm = ["""x"""", "["]',
    "k.l = 2",
]


@settings(deadline=None)
@given(st.lists(st.sampled_from(PIECES), max_size=12))
def test_statements_are_where_they_were_written(pieces):
    found = [(statement.line, statement.text) for statement in statements("\n".join(pieces))]
    line, expected = 1, []
    for piece in pieces:
        if piece and not piece.startswith("#"):
            expected.append((line, piece))
        line += piece.count("\n") + 1
    assert found == expected


@settings(deadline=None, max_examples=200)
@given(st.text(alphabet=list("ab=.,[]{}\"'#\\\n 1"), max_size=60))
def test_any_text_is_read_or_refused(tmp_path_factory, text):
    """And every place in what was read has a line of the text."""
    path = tmp_path_factory.getbasetemp() / "any.toml"
    path.write_text(text)
    try:
        file = TomlFile(path)
    except pc.ModelError as error:
        assert str(error).startswith(f"{path}:")
        return
    count = text.count("\n") + 1
    for key in file.data:
        assert 1 <= int(file.at((key,)).rsplit(":", 1)[1]) <= count
