"""Changes of pictures and of what notebooks show, by hand: file -> (name, what stands there, what is put there)."""

CHANGES = {
    "pycraft/operators/latex_lines.py": [
        ("a sign before a term breaks the line", '"sign" if made and made[-1].kind == "factor" else "prefix"', '"sign"'),
        (
            "lines are filled beyond their width",
            "if lines and size <= room:\n            lines[-1] += _text(term)",
            "if lines:\n            lines[-1] += _text(term)",
        ),
    ],
    "pycraft/operators/shown_expression.py": [
        ("-P is positive", "return e.coefficient > 0 and", "return"),
        ("A M B* is positive", "paired and (len(parts) % 2 == 0 or", "(len(parts) % 2 == 0 or"),
    ],
    "pycraft/identities/terminal_report.py": [("lines go on beside the verdict", "<= width - edge", "<= width")],
    "pycraft/view/plan_picture.py": [
        (
            "arrows go the other way",
            "if direction < 0 else ((x[p], y[p]), (x[k], y[k]))",
            "if direction > 0 else ((x[p], y[p]), (x[k], y[k]))",
        )
    ],
    "pycraft/scenes/lost_digits.py": [("digits are those of no forces", "tau = model.inverse_dynamics(*state)", "tau = 0 * state[1]")],
    "pycraft/scenes/effect_stack.py": [("bars begin at zero", "end += share", "end += 0")],
    "pycraft/identities/truth_picture.py": [
        ("rotors are where there are none", 'if case.rotor_inertia else ""', 'if not case.rotor_inertia else ""')
    ],
}
