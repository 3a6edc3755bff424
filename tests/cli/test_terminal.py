"""Tables in a terminal: 80 columns, nothing that matters cut, no accent that overprints, columns that align, exceptions first."""

import re
import unicodedata

import pytest
from rich.cells import cell_len

import pycraft as pc
from pycraft.accuracy.tables.table import AccuracyTable
from pycraft.identities.parse import Statements
from pycraft.identities.report import Finding, Report
from pycraft.identities.terminal_report import monospace, precision_text, text_of, wrapped
from pycraft.proofs.shown import lines

LONG = "ℳ_pp - ℳ_pf(ℳ_ff)⁻¹ℳ_fp = H_pY*MYH_p*,  Y = ψ_f* - Ω_fP_f and so on and on, in the blocks on one path to the base of φ̃"


def report():
    made = Report("arm", {"J = 0": True})
    for i, verdict in enumerate(("holds", "fails", "undecided", "expected to fail", "holds anyway", "waiting", "undefined")):
        finding = Finding(f"t{i}", f"group {i % 2}", f"{LONG} {i}", "x", ["J = 0"], [], verdict, 1e-16, 1e-13, 1e-33, 2e-30, 50)
        finding.unmet = ["single-DOF hinges"] if verdict in ("expected to fail", "holds anyway") else []
        finding.states, finding.note = (0, "loops") if verdict in ("waiting", "undefined") else (2, "")
        made.findings.append(finding)
    return made


def fits(text, width=80):
    for line in text.splitlines():
        assert cell_len(line) <= width, line
    assert "…" not in text


def test_the_report_of_theorems_fits():
    made = report()
    for text in (repr(made), made.full(), text_of(made.table())):
        fits(text)
    lines = made.full().splitlines()
    numbers = [line for line in lines if "2e-30" in line]
    assert len(numbers) == 6 and "largest residual of what holds: 1.0e-33 in 50 digits, bound 2e-30" in numbers[0]
    assert any(line.startswith("theorem") for line in lines)
    for column in ("2e-30", "50 digits"):  # columns align, in cells and not in characters
        assert len({cell_len(line[: line.index(column)]) for line in numbers[1:]}) == 1
    assert "undefined: an inverse in them does not exist here" in repr(made)


def test_one_line_a_theorem_verdict_first():
    """Every theorem of the catalogue has one line, whatever was found; nothing is cut or wrapped."""
    soa = pc.tree([-1, 0, 0], ["free", "ball", "pin"], seed=1, rotor_inertia=True).soa
    every = ["J = 0", "serial chain", "single-DOF hinges", "constant H", "free root"]
    for verdict, unmet in (("holds", []), ("expected to fail", every[:1]), ("holds anyway", every)):
        findings = [Finding(t.name, t.group, t.text, t.latex, t.hypotheses, unmet, verdict) for t in soa.theorems()]
        lines = text_of(Report("arm", {}, findings).lines()).splitlines()
        fits("\n".join(lines).replace("(…)", "(...)"))  # a formula's own
        assert len(lines) == len(findings) > 100
        for line, found in zip(lines, findings, strict=True):
            assert line.startswith(verdict + "  ")
            said = line.removeprefix(verdict).strip().split("  needs ")[0]
            assert said in (monospace(found.statement).replace("\n", " "), monospace(found.name)), line
    short = Report(
        "arm", {}, [Finding("n", "g", "a = b", "x", [], ["J = 0"], "expected to fail"), Finding("m", "g", "c = d", "x", [], [], "holds")]
    )
    assert text_of(short.lines()).splitlines() == ["expected to fail  a = b  needs J = 0", "holds  c = d"]
    long_name = Finding("the name", "g", "a" * 70 + " = b", "x", [], ["J = 0"], "fails")
    assert text_of(Report("arm", {}, [long_name]).lines()) == "fails  the name  needs J = 0"
    assert repr(Report("arm", {}, [])) == Report("arm", {}, []).summary() and text_of(Report("arm", {}, []).lines()) == ""


def test_a_theorem_that_goes_on_is_no_heading():
    """The second line of a long one began where headings begin."""
    headings = {f.group for f in report().findings} | {"theorem", "arm:", "largest"}
    table = report().full().split("theorem", 1)[1].splitlines()[1:]
    flush = [line for line in table if line[:1].strip()]
    assert flush and all(any(line.startswith(h) for h in headings) for line in flush), flush


def test_plans_fit():
    """A row of the plan is a line, also where it is set in by three; texts of steps are whole."""
    arm = pc.chain(3)
    H, phi, M = arm.soa("H phi M")
    MM = H @ phi @ M @ phi.T @ H.T
    for op in (MM.inv(), (MM + 0.1 * arm.soa.I).inv(), MM.inv().diff(0)):
        notes, rows = str(op.explain()).split("\n", 1)[1].split("  #  step", 1)
        fits(notes, 77)
        fits(rows, 77)
        assert len({line.index(" flop") for line in rows.splitlines() if " flop" in line}) <= 3  # of flop, kflop, Mflop
        assert all(s["text"].replace(" ", "") in rows.replace(" ", "").replace("\n", "") or len(s["text"]) > 36 for s in op.plan().steps)


def test_what_holds_shows_the_scalar_that_decided():
    """Both sides of ΥM = ΥM are rounding of zero in double on a slider without a mass: no residual of 1, no bound above 1e-6, is shown."""
    made = report()
    made.findings[0].residual, made.findings[0].bound = 1.0, 5e9
    assert made.worst == 1e-33
    for text in (repr(made), made.full(), made._repr_html_()):
        assert "1.0e+00" not in text and "5e+09" not in text
    for text, shown in (("Epsi = E_phi taubar", "read as E_ψ = E_φ τ̄"), ("HG = I - 0*D", "read as H G = I")):
        found = repr(pc.check(text, pc.chain(2), states=1))
        assert shown in found and "worst" not in found, found
    assert "read as" not in repr(pc.check("D = HPH*", pc.chain(2), states=1))


def test_text_in_formulas_is_text():
    """MathJax shows an error for _ or ^ in \\text, and no letter of ours there."""
    for t in pc.chain(1).soa.theorems():
        for words in re.findall(r"\\text\{([^{}]*)\}", t.latex):
            assert words.isascii() and not set(words) & set("_^&#%$*"), t.latex


def test_the_summary_of_a_page_has_its_lines():
    assert "3 holds" not in repr(report()) and "<br>largest residual" in report()._repr_html_()


def test_the_summary_and_the_exceptions_come_first():
    made = report()
    assert repr(made).startswith("arm: 1 fails, 1 undecided, 1 undefined,")
    assert "t3  needs single-DOF hinges" in repr(made) and "t0" not in repr(made) and f"{monospace(LONG)[:20]}" in made.full()
    assert repr(made).count("waits for loops") == 1 and len(made.full()) > len(repr(made))
    good = Report("arm", {}, [made.findings[0]])
    assert repr(good) == good.summary() and "1 holds" in good.summary() and "50 digits" in good.full()


@pytest.mark.parametrize("text", ["φMφ* = R + φ̃R + Rφ̃*", "Hτ̄ = 0", "Ḣ = 0", "Ṽ V", "V̄M", "ℳ̇ - 2C = -(ℳ̇ - 2C)*", "ψ = φ"])
def test_letters_are_spelled_in_one_way(text):
    """φ̃ beside φ, as on pages: not phi_tilde, which was another letter beside it; an accent takes no column."""
    assert monospace(text) == unicodedata.normalize("NFC", text) and "_" not in monospace(text)
    assert cell_len(monospace(text)) == sum(not unicodedata.combining(c) for c in monospace(text))


def test_every_letter_has_a_spelling_that_reads_back():
    """Text shown in a terminal can be typed again."""
    soa = pc.tree([-1, 0], ["ball", "universal"], seed=1).soa
    for name, shown in ((s.name, s.text) for s in pc._core.symbols if s.takes == "nothing"):
        typed = monospace(shown)
        assert Statements(soa).read(typed).lhs == getattr(soa, name), (name, typed)


def test_reports_of_statements_fit():
    arm = pc.tree([-1, 0, 0, 1], ["pin", "ball", "universal", "pin"], seed=1, rotor_inertia=True)
    for text in ("HψMψ*H* = D", "φMφ* = R + φ̃R + Rφ̃*", "φ = φ̃ + φ̃"):
        fits(repr(pc.check(text, arm, states=1)))
    fits(wrapped("  " + "word " * 60))
    assert precision_text(50) == "50 digits" and precision_text("quad") == "quad"


def test_accuracy_tables_fit():
    row = dict.fromkeys(AccuracyTable.columns) | {
        "way": "square-root + 1 refinement, wider residual", "precision": "extended", "error": 1.2e-16, "component": 3.4e-15,
        "seconds": 1.234e-6, "cost": 241.0, "bytes": 10400, "states": 5, "pareto": True, "rounded": False, "refused": "",
    }  # fmt: skip
    table = AccuracyTable("Forward dynamics of something with a long name, 7 degrees of freedom, five states", [
        row, row | {"precision": "100", "pareto": False}, row | {"way": "conjugate-gradients", "refused": "no mass at 'elbow'"},
    ])  # fmt: skip
    text = text_of(table.table(80))
    fits(text)
    words = ("1.2e-16", "3.4e-15", "1.23 µs", "241 x", "10.4 kB", "extended", "100 digits")
    for word in (*words, "square-root + 1", "refused", "* Pareto front"):
        assert word in text, (word, text)
    assert "rounded" not in text and "conjugate-gradients" in text
    assert "refused: no mass at 'elbow'" in text_of(table.table(160), 160)


def test_tables_of_integrators_and_of_hard_cases_fit():
    from pycraft.accuracy.hard_cases.stability_table import COLUMNS, Stability
    from pycraft.accuracy.tables.work_precision import WorkPrecisionTable

    run = dict.fromkeys(WorkPrecisionTable.columns) | {
        "integrator": "bulirsch-stoer", "tolerance": 1e-9, "error": 1e-13, "drift": 2e-13, "seconds": 1.234e-3,
        "evaluations": 65536, "resolved": False, "refused": "",
    }  # fmt: skip
    text = text_of(WorkPrecisionTable("Integration", [run], {"reference": "x", "reference_error": 1e-12}).table(80))
    fits(text)
    assert "energy drift" in text and "< 1.0e-12" in text and "bulirsch-stoer" in text
    row = dict.fromkeys(COLUMNS) | {
        "case": "a wrist at its singularity, the middle link of 1e-06 kg", "method": "square-root + refinement, wider residual, extended",
        "median": 1e-16, "p95": 2e-16, "worst": 3e-16, "refused": 2, "seeds": 20, "ratio": 1.5, "passed": False, "failed": "worst " * 9,
    }  # fmt: skip
    text = text_of(Stability([row, row | {"method": "fast", "passed": True}]).table(80))
    fits(text)
    assert text.count("a wrist at its singularity") == 1 and "! a bound does not hold" in text and "2 of 20" in text


def test_proofs_fit():
    """Steps with their reasons beside them where there is room, statements and what they rest on whole; so do the blocks of a robot."""
    arm = pc.robots.panda()
    proofs = [pc.prove(statement) for statement in ("ℳ⁻¹ = (I-HψK)* D⁻¹ (I-HψK)", "ψ⁻¹ = φ⁻¹ + 𝒦H", "φMφ* = ψPψ* + 2 φ P φ* + E_psi P")]
    for text in (*map(str, proofs), str(proofs[0].full()), repr(arm.soa.phi.blocks())):
        assert max(map(cell_len, text.splitlines())) <= 80, text
    steps = proofs[0].steps
    shown = "".join("".join(lines(steps)).split())
    assert all("".join(f"={step.after_text()}".split()) in shown for step in steps)  # nothing is cut
