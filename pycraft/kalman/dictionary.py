"""The dictionary of the book's letters and their meaning in a filter, as a table in text, HTML and LaTeX."""

from __future__ import annotations

import re
from html import escape

# (LaTeX of the letter, its name in Python, its meaning in the filter with LaTeX between dollars, shape of one block)
_DICTIONARY = (
    ("k", "", "time step: body $k$ of $N$ is step $t = N - 1 - k$; the tip is the first step, the base the last", ""),
    (r"\mathcal{E}_\phi", "E", "transition $A_t$, from step $t$ to $t + 1$", "(n, n)"),
    ("H", "H", "measurement matrix $C_t$", "(m, n)"),
    ("M", "M", "process noise $B Q B^*$ that enters a step; $P_0$ at the tip", "(n, n)"),
    ("J", "J", "measurement noise $R_t$", "(m, m)"),
    (r"\phi", "phi", r"states of all steps from the noises: $x = \phi(B w + x_0)$", ""),
    (r"\mathcal{M} + J", "covariance", r"covariance of all measurements together: $H\phi M\phi^*H^* + J$", ""),
    (r"\mathcal{R}", "R", r"covariance of the state without measurements: $\phi M\phi^* = R + \tilde\phi R + R\tilde\phi^*$", "(n, n)"),
    ("P", "P", "covariance of the predicted state, $P(t|t-1)$", "(n, n)"),
    ("P^{+}", "P_plus", "covariance of the filtered state, $P(t|t)$", "(n, n)"),
    (r"\mathcal{D}", "D", "covariance of the innovation: $C P C^* + R_t$", "(m, m)"),
    (r"\mathcal{G}", "G", "Kalman gain", "(n, m)"),
    (r"\mathcal{K}", "K", "predictor gain $A G$, from an innovation to the next prediction", "(n, m)"),
    (r"\bar\tau", "tau_bar", "$I - G C$", "(n, n)"),
    (r"\mathcal{E}_\psi", "E_psi", "transition of the filter: $A (I - G C)$", "(n, n)"),
    (r"\psi", "psi", r"predictions of all steps from the measurements: $z = \psi(K y + x_0)$", ""),
    ("z", "", "predicted state $x(t|t-1)$", "(n,)"),
    (r"\epsilon = [I - H\psi\mathcal{K}]y", "(I - H@psi@K) @ y", "innovations: the new information of each measurement", "(m,)"),
    (r"\lambda = \psi^*H^*\mathcal{D}^{-1}\epsilon", "psi.T@H.T@D.inv() @ eps", "adjoint variable, backward in time", "(n,)"),
    (r"\Upsilon", "Upsilon", r"adjoint information: covariance of $\lambda$, the blocks of $\Omega$ on the diagonal", "(n, n)"),
    (r"z + P\lambda", "z + P @ lam", "smoothed state $x(t|N)$", "(n,)"),
    (r"P - P\Upsilon P", "P - P@Upsilon@P", "covariance of the smoothed state", "(n, n)"),
    (r"\phi(M - M\Omega M)\phi^*", "posterior", "covariance of all smoothed states together, including between steps", ""),
    (r"M\lambda", "M @ lam", "smoothed process noise $B w$", "(n,)"),
)  # fmt: skip
_UNICODE = {
    r"\mathcal{E}_\phi": "E_φ", r"\mathcal{E}_\psi": "E_ψ", r"\mathcal{M}": "ℳ", r"\tilde\phi": "φ̃", r"\bar\tau": "τ̄", r"\phi": "φ",
    r"\psi": "ψ", r"\lambda": "λ", r"\epsilon": "ε", r"\Upsilon": "Υ", r"\Omega": "Ω", "^{-1}": "⁻¹", "^{+}": "⁺", "^*": "*", "$": "",
}  # fmt: skip


def _plain(text: str) -> str:
    """Return LaTeX as Unicode."""
    text = re.sub(r"(\\[A-Za-z]+) (?=[A-Z])", r"\1", text)  # the space that ends a command
    for latex, letter in _UNICODE.items():
        text = text.replace(latex, letter)
    return re.sub(r"\\mathcal\{(\w)\}", r"\1", text)


class Dictionary:
    """The table of book letters and filter quantities: prints as text, shows as HTML, `latex()` is a tabular. `.rows` are dicts."""

    @property
    def rows(self) -> list[dict[str, str]]:
        """Rows with letter, latex, name (in Python), meaning, shape (of one block) of every entry."""
        return [
            {"letter": _plain(latex), "latex": latex, "name": name, "meaning": _plain(meaning), "shape": shape}
            for latex, name, meaning, shape in _DICTIONARY
        ]

    def __str__(self) -> str:
        width = max(len(row["letter"]) for row in self.rows) + 2
        return "\n".join(f"{row['letter']:<{width}}{row['meaning']}{' ' + row['shape'] if row['shape'] else ''}" for row in self.rows)

    __repr__ = __str__

    def _repr_html_(self) -> str:
        cells = "".join(
            f"<tr><td style='text-align:left'>\\({escape(latex)}\\)</td><td style='text-align:left'><code>{escape(name)}</code></td>"
            f"<td style='text-align:left'>{re.sub(r'[$]([^$]*)[$]', lambda m: chr(92) + '(' + m[1] + chr(92) + ')', escape(meaning))}</td>"
            f"<td style='text-align:left;white-space:nowrap'>{escape(shape)}</td></tr>"
            for latex, name, meaning, shape in _DICTIONARY
        )
        titles = "".join(f"<th style='text-align:left'>{title}</th>" for title in ("letter", "in Python", "in the filter", "one block"))
        return f"<table style='table-layout:auto'><tr>{titles}</tr>{cells}</table>"

    def latex(self) -> str:
        """Return the table as a LaTeX tabular."""
        lines = [rf"${latex}$ & {meaning} \\" for latex, _, meaning, _ in _DICTIONARY]
        return "\n".join([r"\begin{tabular}{ll}", r"book & filter \\", r"\hline", *lines, r"\end{tabular}"])
