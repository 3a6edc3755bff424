"""Notebooks as PDF, by nbconvert; in LaTeX the letters of the algebra are there in code, too, whose fonts do not have them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from .. import _core
from ..operators.latex_text import MATHEMATICS

_ACCENTS = {"\u0303": r"\~{}", "\u0304": r"\={}", "\u0307": r"\.{}", "\u0308": r"\"{}"}
"""Set over the letter before them."""


def to_pdf(notebook: str | Path) -> Path:
    """A notebook as PDF beside it, by nbconvert: through LaTeX where XeLaTeX is installed, else through a browser.

    Raises
    ------
    ModelError
        nbconvert (extra [lab]), or both ways of making a PDF, are missing; the text says what to install.
    """
    path = Path(notebook)
    try:
        import nbconvert
    except ImportError:
        raise _core.ModelError("PDF is made by nbconvert, which is not installed: pip install 'pycraft-soa[lab]'") from None

    class Lettered(nbconvert.PDFExporter):
        def run_latex(self, filename: str, *rest: Any, **options: Any) -> Any:
            with_letters(Path(filename))
            return super().run_latex(filename, *rest, **options)

    reasons = []
    for exporter in (Lettered, nbconvert.WebPDFExporter):
        try:
            body: Any = exporter().from_filename(str(path))[0]
        except Exception as error:  # whatever LaTeX, pandoc or a browser says: it is the reason
            reasons.append(str(error).strip().partition("\n")[0] or type(error).__name__)
            continue
        out = path.with_suffix(".pdf")
        out.write_bytes(body)
        return out
    needs = "a PDF takes pandoc and XeLaTeX, or a browser: pip install 'nbconvert[webpdf]', then playwright install chromium"
    raise _core.ModelError(f"{path.name}: {needs} (tried both: {' '.join(reasons)})")


def with_letters(file: Path) -> None:
    """Let a LaTeX file show letters that its fonts may not have: each becomes a command where the document begins."""
    made = {letter: rf"\ensuremath{{{latex}}}" for letter, latex in MATHEMATICS.items()}
    made |= {accent: rf"\llap{{{command}}}" for accent, command in _ACCENTS.items()}
    commands = "".join(f'\\catcode"{ord(letter):X}=13\\protected\\def {letter}{{{command}}}%\n' for letter, command in made.items())
    text = file.read_text(encoding="utf-8")
    file.write_text(text.replace("\\begin{document}", "\\begin{document}%\n" + commands, 1), encoding="utf-8")
