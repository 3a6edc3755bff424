"""Worksheets: each student's own gaps, a key that the judge accepts, grading by proof of what is handed in and of nothing else."""

import json

import pytest

import pycraft as pc
from pycraft.proofs.pdf import with_letters
from pycraft.proofs.worksheet import TOPICS, _gaps, grade, worksheet


def handed_in(path, answers):
    """The notebook at `path` with answers {(question, line): text} filled in."""
    notebook = json.loads(path.read_text())
    for cell in notebook["cells"]:
        for tag in cell["metadata"].get("tags", []):
            question = int(tag.removeprefix("answers-"))
            filled = {line: text for (q, line), text in answers.items() if q == question}
            cell["source"] = f"# mine\nanswers_{question} = {filled!r}\n"
    path.write_text(json.dumps(notebook))


@pytest.fixture(scope="module")
def sheets():
    return worksheet("factorization", students=12, seed=3, questions=2)


def solutions(sheet):
    return {
        (k, line): question.exercise().gap(line).solution().split("   [")[0]
        for k, question in enumerate(sheet.questions, 1)
        for line in question.blanks
    }


def test_every_student_has_a_sheet_of_their_own(sheets):
    assert len(sheets) == 12 and [s.student for s in sheets][:2] == ["student01", "student02"]
    assert len({tuple(s.questions) for s in sheets}) >= 8 and all(len(s.questions) == 2 for s in sheets)
    again = worksheet("factorization", students=12, seed=3, questions=2)
    assert [s.questions for s in again] == [s.questions for s in sheets]
    assert [s.questions for s in worksheet("factorization", students=12, seed=4, questions=2)] != [s.questions for s in sheets]


@pytest.mark.parametrize("topic", TOPICS)
def test_the_key_of_every_topic_is_accepted(topic):
    sheet = worksheet(topic, students=1, seed=1)[0]
    for (k, line), text in solutions(sheet).items():
        judgement = sheet.questions[k - 1].exercise().gap(line).answer(text)
        assert judgement, (sheet.questions[k - 1], line, text, judgement)


def test_what_is_handed_in_is_graded_by_proof(sheets, tmp_path):
    sheets.save(tmp_path)
    right = solutions(sheets[0])
    handed_in(tmp_path / "student01.ipynb", right)
    first = next(iter(right))
    handed_in(tmp_path / "student02.ipynb", dict.fromkeys(solutions(sheets[1]), "φ + "))
    (tmp_path / "student03.ipynb").unlink()
    grades = sheets.grade(tmp_path)
    assert (grades[0].points, grades[0].possible) == (len(right), len(right)) and "right" in repr(grades[0])
    assert grades[1].points == 0 and {j.verdict for j in grades[1].judgements.values()} == {"unreadable"}
    assert grades[2].points == 0 and {j.verdict for j in grades[2].judgements.values()} == {"no answer"}
    handed_in(tmp_path / "student01.ipynb", right | {first: f"2*({right[first]})"})
    assert grade(tmp_path / "student01.ipynb").points == len(right) - 1


def test_no_two_lines_in_a_row_are_left_out(sheets):
    """Each answer is then judged between lines that are seen."""
    pairs = [question.blanks for sheet in sheets for question in sheet.questions if len(question.blanks) == 2]
    assert pairs and all(last - first > 1 for first, last in pairs)


def test_a_line_that_only_names_what_is_there_is_not_asked_for(monkeypatch):
    """Line 4 calls a part of line 5 by a name that no statement reads."""
    task = pc.exercise("Ω decomposed with siblings")
    monkeypatch.setattr(type(task), "gaps", lambda self: [1, 4])
    assert _gaps(task) == [1] and not task.leaving_out(4).answer(task.steps[3].after_text())
    monkeypatch.setattr(type(task), "gaps", lambda self: [4])
    assert _gaps(task) == [4]  # where there is no other


def test_another_question_in_the_file_is_not_graded(sheets, tmp_path):
    """With the sheets at hand the questions are those handed out, and nothing of a student's notebook is run."""
    sheets.save(tmp_path)
    path = tmp_path / "student01.ipynb"
    notebook = json.loads(path.read_text())
    notebook["metadata"]["pycraft"]["questions"] = [{"statement": "τ² = τ", "blanks": [1]}]
    for cell in notebook["cells"]:
        if cell["cell_type"] == "code":
            cell["source"] = "raise SystemExit\nanswers_1 = {1: __import__('os').getcwd()}"
    path.write_text(json.dumps(notebook))
    result = sheets.grade(tmp_path)[0]
    assert set(result.judgements) == set(solutions(sheets[0])) and result.points == 0


def test_notebooks_are_notebooks_without_solutions(sheets, tmp_path):
    nbformat = pytest.importorskip("nbformat")
    for path in sheets.save(tmp_path):
        nbformat.validate(nbformat.read(path, as_version=4))
    sheet, text = sheets[0], (tmp_path / "student01.ipynb").read_text()
    assert "boxed" in text and not any(solution in text for solution in solutions(sheet).values())
    key = (tmp_path / "key" / "student01.ipynb").read_text()
    assert all(solution in key for solution in solutions(sheet).values()) and "Answer key" in key


def test_the_notebooks_last_cell_judges(sheets, capsys):
    sheet, right = sheets[0], solutions(sheets[0])
    names = {f"answers_{k}": {b: right[k, b] for b in q.blanks} for k, q in enumerate(sheet.questions, 1)}
    exec(sheet.notebook()["cells"][-1]["source"], names)
    assert capsys.readouterr().out.count("right") == len(right)


def test_what_a_worksheet_cannot_be(tmp_path):
    with pytest.raises(pc.EvaluationError, match="no topic is called 'robots'; there are resolvents, "):
        worksheet("robots")
    with pytest.raises(pc.EvaluationError, match="no proof"):
        worksheet(["HψM = 0"])
    with pytest.raises(pc.EvaluationError, match="different names"):
        worksheet("inverse", students=["a", "a"])
    with pytest.raises(pc.EvaluationError, match="at least one statement, one student, one question and one blank"):
        worksheet("inverse", students=0)
    for students in ("ada", 2.5, [1, 2], None, True):
        with pytest.raises(pc.EvaluationError, match="students=.*: give their number, or a list of their names"):
            worksheet("inverse", students=students)
    (tmp_path / "x.ipynb").write_text("{}")
    with pytest.raises(pc.ModelError, match="is not the notebook of a worksheet"):
        grade(tmp_path / "x.ipynb")
    with pytest.raises(pc.ModelError, match="is not the notebook of a worksheet"):
        grade(tmp_path / "none.ipynb")


def test_a_class_prints_as_a_list(sheets):
    lines = repr(sheets).splitlines()
    assert lines[0] == "12 worksheets: factorization" and all(len(line) <= 80 for line in lines)
    assert all(any(line.startswith(f"  {sheet.student}: ") for line in lines) for sheet in sheets) and "Question(" not in repr(sheets)


def test_pdfs(sheets, tmp_path, monkeypatch):
    """Through LaTeX, else through a browser; where neither is there, one line says what to install, and the notebooks are written."""
    nbconvert = pytest.importorskip("nbconvert")

    class Missing:
        def from_filename(self, path):
            raise OSError("no such program\nand more of it")

    class Browser:
        def from_filename(self, path):
            return b"%PDF of " + path.encode(), {}

    monkeypatch.setattr(nbconvert, "PDFExporter", Missing)
    monkeypatch.setattr(nbconvert, "WebPDFExporter", Missing)
    one = type(sheets)("factorization", sheets.sheets[:1])
    with pytest.raises(pc.ModelError, match="nbconvert.webpdf.*playwright install chromium.*no such program no such program") as refused:
        one.save(tmp_path, pdf=True)
    assert "\n" not in str(refused.value) and (tmp_path / "key" / "student01.ipynb").is_file()
    monkeypatch.setattr(nbconvert, "WebPDFExporter", Browser)
    written = one.save(tmp_path, pdf=True)
    assert [p.name for p in written] == ["student01.ipynb", "student01.ipynb", "student01.pdf", "student01.pdf"]
    assert written[2].read_bytes().startswith(b"%PDF of ")


def test_what_is_in_a_worksheet_has_its_letters_in_latex(tmp_path):
    """Fonts of code have none of them: a PDF of the key read `[I + H K]`."""
    shown = {
        c
        for topic in list(TOPICS)[:2]
        for solved in (False, True)
        for c in json.dumps(worksheet(topic, 1)[0].notebook(solved)["cells"], ensure_ascii=False)
    }
    file = tmp_path / "sheet.tex"
    file.write_text("\\documentclass{article}\n\\begin{document}\nφ\n\\end{document}\n", encoding="utf-8")
    with_letters(file)
    head, _, body = file.read_text(encoding="utf-8").partition("\\begin{document}")
    assert head == "\\documentclass{article}\n" and body.endswith("\nφ\n\\end{document}\n")
    assert {c for c in shown if not c.isascii()} <= set(body) and "\\def φ{\\ensuremath{\\phi}}" in body


def test_derivations_keep_to_the_width_of_a_page():
    """Reasons stand beside the lines, or below them all where a line and a reason are too long for one row; steps count from 1."""
    short, long = pc.exercise("HψMψ*H* == D", blank=2), pc.exercise("[I+HφK]⁻¹ = I - HψK", blank=2).leaving_out(2)
    assert "&& \\text{1.}" in short.latex() and "\\qquad" not in short.latex()
    assert "&&" not in long.latex() and [rf"\qquad \text{{{i}.}}" in long.latex() for i in range(4)] == [False, True, True, True]


def test_exercises_with_several_gaps():
    task = pc.exercise("HψMψ*H* == D", blank=[2, 4])
    assert task.blanks == (2, 4) and task.lines.count("?") == 2 and str(task).count("= ?") == 2 and task.latex().count("boxed") == 2
    found = task.answer({2: "HψPH* + HPψ*H* - D", 4: "HGD + DG*H* - D"})
    assert set(found) == {2, 4} and all(found.values())
    assert task.blank == 2 and task.answer("HψPH* + HPψ*H* - D") and not task.gap(4).answer("2HGD")
    assert task.gap(4).solution() != task.solution() and task.gap(4).hint(1)
    hidden = task.gap(2).answer("HGD + DG*H* - D")  # the other gap's line is not on the page
    assert hidden.verdict != "no step"
    with pytest.raises(pc.EvaluationError, match="line 3 is not a gap of this exercise; its gaps are 2, 4"):
        task.gap(3)
    with pytest.raises(pc.EvaluationError, match="there is no line 9"):
        pc.exercise("HψMψ*H* == D", blank=[2, 9])
    for blank in ("2", 2.5, True, [1.0], ["1"]):
        with pytest.raises(pc.EvaluationError, match="blank=.*number"):
            pc.exercise("HψMψ*H* == D", blank=blank)
    with pytest.raises(pc.EvaluationError, match="level must be 1, 2, 3"):
        task.hint("much")
    with pytest.raises(pc.EvaluationError, match=r"a theorem's name, a statement as text or a pair \(lhs, rhs\), not of 3"):
        pc.exercise(3)
    with pytest.raises(pc.EvaluationError, match=r"blank=\[\] names none"):
        pc.exercise("HψMψ*H* == D", blank=[])
