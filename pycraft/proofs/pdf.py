"""Notebooks as PDF, by nbconvert; in LaTeX the letters of the algebra also work in code, whose fonts lack them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from .. import _core
from ..operators.latex_text import MATHEMATICS

_ACCENTS = {"\u0303": r"\~{}", "\u0304": r"\={}", "\u0307": r"\.{}", "\u0308": r"\"{}"}
"""Accents, set over the letter before them."""


def to_pdf(notebook: str | Path) -> Path:
    """Write a notebook as PDF beside it, by nbconvert: through LaTeX if XeLaTeX is installed, else through a browser.

    Raises
    ------
    ModelError
        nbconvert (extra [lab]) is missing, or both LaTeX and a browser are; the message says what to install.
    """
    path = Path(notebook)
    try:
        import nbconvert
    except ImportError:
        raise _core.ModelError("PDF output needs nbconvert, which is not installed: pip install 'pycraft-soa[lab]'") from None

    class Lettered(nbconvert.PDFExporter):
        def run_latex(self, filename: str, *rest: Any, **options: Any) -> Any:
            with_letters(Path(filename))
            return super().run_latex(filename, *rest, **options)

    reasons = []
    for exporter in (Lettered, nbconvert.WebPDFExporter):
        try:
            body: Any = exporter().from_filename(str(path))[0]
        except Exception as error:  # LaTeX, pandoc and browsers raise anything: report it
            reasons.append(str(error).strip().partition("\n")[0] or type(error).__name__)
            continue
        out = path.with_suffix(".pdf")
        out.write_bytes(body)
        return out
    needs = "PDF output needs pandoc and XeLaTeX, or a browser: pip install 'nbconvert[webpdf]', then playwright install chromium"
    raise _core.ModelError(f"{path.name}: {needs} (tried both: {' '.join(reasons)})")


def with_letters(file: Path) -> None:
    """Let a LaTeX file show letters that its fonts may lack: each becomes a command at the beginning of the document."""
    made = {letter: rf"\ensuremath{{{latex}}}" for letter, latex in MATHEMATICS.items()}
    made |= {accent: rf"\llap{{{command}}}" for accent, command in _ACCENTS.items()}
    commands = "".join(f'\\catcode"{ord(letter):X}=13\\protected\\def {letter}{{{command}}}%\n' for letter, command in made.items())
    text = file.read_text(encoding="utf-8")
    file.write_text(text.replace("\\begin{document}", "\\begin{document}%\n" + commands, 1), encoding="utf-8")
