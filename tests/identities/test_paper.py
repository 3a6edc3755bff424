"""`pycraft check paper.tex`: every displayed equation is found, read, and given a verdict with its line."""

import json
import shutil
from pathlib import Path

import pytest

import pycraft as pc
from pycraft.identities.paper import Equation, PaperReport, check_paper, equations

PAPER = Path(__file__).parent / "paper.tex"


@pytest.fixture(scope="module")
def report(tmp_path_factory):
    deep = tmp_path_factory.mktemp("a_directory_whose_name_is_longer_than_a_line_of_a_terminal_of_eighty_columns")
    return check_paper(shutil.copy(PAPER, deep), pc.tree([-1, 0], ["pin", "slider"], seed=1), states=2, search=False)


def test_every_display_is_found_with_its_line(report):
    found = [(e.line, e.verdict) for e in report.equations]
    assert found == [
        (9, "holds"),
        (13, "holds"),
        (14, "holds"),
        (17, "fails"),
        (20, "holds"),  # the chain over rows: both of its statements
        (20, "holds"),
        (24, "holds"),
        (24, "holds"),
        (27, "holds"),  # on a chain it does
        (31, "not read"),
        (32, "not read"),
    ], repr(report)
    lines = PAPER.read_text().split("\n")
    for e in report.equations:
        assert any(word in lines[e.line - 1] for word in ("\\M", "\\inv", "\\psi", "\\E", "\\Omega", "c^2", "\\int"))


def test_the_report_tells_all(report):
    assert not report and report.counts == {"holds": 8, "fails": 1, "not read": 2}
    shown = repr(report)
    assert "paper.tex:17: fails" in shown and "paper.tex:31: not read" in shown and "it has no equals sign" in shown
    assert shown.endswith("\npaper.tex: 11 equations: 1 fails, 8 holds, 2 not read")  # however long the path above it is
    assert [e["line"] for e in json.loads(report.to_json())["equations"]] == [e.line for e in report.equations]


@pytest.fixture
def judged(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)

    def judge(*rows, **options):
        Path("p.tex").write_text("\n".join(rows), encoding="utf-8")
        return check_paper("p.tex", **options)

    return judge


def test_the_books_formulas_are_true_under_their_hypotheses(judged):
    """In papers J = 0 stands in words, if at all: every second formula of the book was said to fail."""
    report = judged(r"\[ H\mathcal{G} = I \]", r"\[ \mathcal{G} = PH^*\mathcal{D} \]", states=1)
    assert [(e.verdict, e.where) for e in report.equations] == [("true where", "J = 0"), ("fails", "")]
    assert report.status == 1 and report.summary().endswith("2 equations: 1 fails, 1 true where J = 0")
    shown = repr(report).split("\n")
    assert shown[0] == r"p.tex:1: true where J = 0: H\mathcal{G} = I" and shown[1] == "    read as H G = I"
    assert all(len(line) <= 80 for line in shown[1:-1]) and "0 models" not in repr(report) and "is smaller" in repr(report)
    report.equations.pop()
    assert report and report.status == 0
    arm = pc.tree([-1], ["pin"], seed=1, rotor_inertia=True)  # on a model of one's own it is true or not
    assert [e.verdict for e in judged(r"\[ H\mathcal{G} = I \]", model=arm, states=1).equations] == ["fails"]


@pytest.mark.parametrize(
    ("text", "verdict", "words"),
    [
        (r"\tau P = P \tau", "fails", "spaces do not fit"),  # it was "not read", and passed
        (r"M = H\phi M\phi^*H^*", "fails", "spaces do not fit"),
        (r"\mathcal D = \ln\det \mathcal M", "fails", "one is an operator, the other a number"),
        ("G(k) = P(k) D(k)", "fails", "spaces do not fit"),
        ("I = I", "not read", "has no space"),
        ("1 = 2", "not read", "not only numbers"),
    ],
)
def test_spaces_that_do_not_fit_fail(judged, text, verdict, words):
    report = judged(rf"\[ {text} \]", model=pc.chain(2), states=1)
    assert [e.verdict for e in report.equations] == [verdict] and words in report.equations[0].note


def test_arguments_and_bare_macros_read(judged):
    r"""\mathcal{M}(\theta) is \mathcal{M}; a macro may begin with the sign that raises it."""
    rows = [r"\newcommand{\T}{^{*}}\newcommand{\M}{\mathcal{M}}\newcommand{\two}{2}", r"\[ \M(\theta) = H\phi M\phi\T H\T \]"]
    rows += [r"\[ \M(q, \dot q)^\two = \M \left(\theta,\dot{\theta}\right) \M \]", r"\[ D(\theta) = (\theta) \]"]
    report = judged(*rows, model=pc.chain(2), states=1)
    assert [e.verdict for e in report.equations] == ["holds", "holds", "not read"], repr(report)
    assert "{^{*}}" not in report.equations[0].latex and r"^{2}" in report.equations[1].latex


def test_what_is_not_read_shows_the_place(report):
    note = next(e.note for e in report.equations if e.line == 31)
    assert "no operator is called" in note and "^" in note.split("\n")[-1]


def test_macros_comments_and_conditions():
    source = "\n".join(
        [
            r"\newcommand\pair[2]{#1 #2^{*}}  % \[ not = this \]",
            r"\newcommand{\loop}{\loop}",
            r"\[ \pair{\phi}{\psi} = I, \quad \text{for all trees}, \qquad D = D \] costs 5\% \[ \loop = 0 \]",
        ]
    )
    found = [(line, " ".join(text.split())) for line, text in equations(source)]
    assert found[:2] == [(3, r"\phi \psi^{*} = I"), (3, "D = D")] and len(found) == 3


@pytest.mark.parametrize("sign", ["-", "+", "=", r"\cdot ", r"\times "])
def test_a_row_that_begins_with_a_sign_goes_on(sign):
    source = "\\begin{align}\nA &= B \\\\\n&" + sign + "C \\\\\nD &= E\n\\end{align}"
    assert [(line, " ".join(text.split())) for line, text in equations(source)] == [(2, f"A = B {sign}C"), (4, "D = E")]


@pytest.mark.parametrize(
    ("verdicts", "status"),
    [
        (["holds", "undecided"], 3),
        (["undecided", "fails"], 1),
        (["holds", "fails"], 1),
        (["holds", "true where", "not read"], 0),
        (["not read"], 1),
    ],
)
def test_what_fails_is_told_before_what_is_undecided(verdicts, status):
    report = PaperReport("p.tex", [Equation(k, "", verdict) for k, verdict in enumerate(verdicts)])
    assert report.status == status and bool(report) == (status == 0)


def test_files_that_cannot_be_read(tmp_path):
    with pytest.raises(pc.ModelError, match="No such file"):
        check_paper(tmp_path / "none.tex")
    (tmp_path / "latin.tex").write_bytes("\\[ é \\]".encode("latin-1"))
    with pytest.raises(pc.ModelError, match="not text in UTF-8 at byte 3"):
        check_paper(tmp_path / "latin.tex")
    (tmp_path / "empty.tex").write_text("no equation here")
    report = check_paper(tmp_path / "empty.tex")
    assert not report and report.summary().endswith("0 equations; none is displayed")
