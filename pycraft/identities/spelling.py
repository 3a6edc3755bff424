r"""Spellings: what people type, Unicode or LaTeX, brought to the ASCII names and suffixes that the grammar of statements knows.

Three tables of patterns are applied in order: layout and text of LaTeX (``\left``, ``\mathrm{tr}``, ``\begin{align}``), its letters (fonts,
Greek, accents), and Unicode with the exponents of both. Every character of the result remembers where it was typed, so that an error
can show the place in the user's own text.
"""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import lru_cache

from .. import _core

Replacement = str | Callable[[re.Match[str]], str]
Rule = tuple[re.Pattern[str], Replacement]


@dataclass
class Spelled:
    """Text in the grammar's spelling; `origins[i]` is where character i was typed in `typed` (one more at the end)."""

    typed: str
    text: str
    origins: list[int]

    def rewrite(self, rule: Rule) -> None:
        """Replace every match of a rule; what replaces it stems from where the match began."""
        pattern, replacement = rule
        pieces, origins, end = [], [], 0
        for match in pattern.finditer(self.text):
            if match.start() == match.end():
                continue
            new = replacement(match) if callable(replacement) else match.expand(replacement)
            pieces += [self.text[end : match.start()], new]
            origins += self.origins[end : match.start()] + [self.origins[match.start()]] * len(new)
            end = match.end()
        if end:
            self.text = "".join(pieces) + self.text[end:]
            self.origins = origins + self.origins[end:]

    def apply(self, table: list[Rule]) -> bool:
        """Rewrite by every rule of a table in order; whether anything changed."""
        before = self.text
        for rule in table:
            self.rewrite(rule)
        return self.text != before

    def place(self, at: int) -> str:
        """The typed line in which character `at` lies, and a caret below the place."""
        while at < len(self.text) and self.text[at].isspace():
            at += 1
        origin = self.origins[min(at, len(self.text))]
        while origin < len(self.typed) and self.typed[origin].isspace():
            origin += 1
        begin = self.typed.rfind("\n", 0, origin) + 1
        line = self.typed[begin:].split("\n", 1)[0]
        columns = sum(not unicodedata.combining(c) for c in self.typed[begin:origin])
        return f"{line}\n{' ' * columns}^"


def _rules(table: Iterable[tuple[str, Replacement]]) -> list[Rule]:
    return [(re.compile(pattern), replacement) for pattern, replacement in table]


# ------------------------------------------------------------------ the layout of LaTeX, and its words

_WORDS = {
    "tr": "trace", "Tr": "trace", "trace": "trace", "blockdiag": "blockdiag", "blkdiag": "blockdiag", "bdiag": "blockdiag", "inv": "inv",
    "sqrt": "sqrt", "logdet": "logdet", "norm": "norm", "ln": "ln", "log": "ln", "det": "det",
}  # fmt: skip


def _arguments(found: re.Match[str]) -> str:
    r"""Γ_{\mathrm{a\_b, c}} as Γ(a_b, c); a subscript that is one letter belongs to its name."""
    inner = re.sub(r"\\(.)", r"\1", found[1])
    return "(" + inner + ")"


def _word(found: re.Match[str]) -> str:
    r"""\mathrm{tr} and \operatorname{tr} are functions, \mathrm{D} a letter in another font."""
    return f" {_WORDS.get(found[1], found[1])} "


_LAYOUT = _rules(
    [
        (r"\\(begin|end)\s*\{[a-zA-Z]+\*?\}(\{[^{}]*\})?", " "),
        (r"\\(label|tag\*?)\s*\{[^{}]*\}|\\(nonumber|notag)(?![A-Za-z])", " "),
        (r"\\(left|right|middle|[bB]igg?[lrm]?)(?![A-Za-z])\s*\.?", " "),
        (r"\\(displaystyle|textstyle|quad|qquad|thinspace|negthinspace|hspace\*?\{[^{}]*\})(?![A-Za-z])", " "),
        (r"\\[!,;:>]|\\\\|\$|&|~", " "),
        (r"\\(?=\s)", " "),
        (r"\\(lbrack|\{)", "("),
        (r"\\(rbrack|\})", ")"),
        (r"_\{\\(?:mathrm|text|textrm|mathit)\{((?:[^{}\\]|\\.)+)\}\}", _arguments),
        (r"\\(?:operatorname\*?|mathrm|text|textrm|textnormal|mathsf|mathit|mathbf)\s*\{\s*([A-Za-z]{2,})\s*\}", _word),
        (r"\\(?:ln|log)(?![A-Za-z])", " ln "),
        (r"\\[tdc]?frac\s*\{\s*(?:\\mathrm\s*)?\{?\s*d\s*\}?\s*\}\s*\{\s*(?:\\mathrm\s*)?\{?\s*d\s*\}?\s*t\s*\}", " ∂_t "),
        (r"\\[tdc]?frac\s*\{\s*\\partial\s*\}\s*\{\s*\\partial\s*\\theta\s*_\s*\{?\s*([ij])\s*\}?\s*\}", r" ∂_\1 "),
        (r"\\partial(?![A-Za-z])", "∂"),
        (r"\\ddot\s*\{?\s*\\theta(?![A-Za-z])\s*\}?", " θ\u0308 "),
        (r"\\(det|[Tt]r)(?![A-Za-z])", _word),
        (r"\\(?:stackrel|overset)\s*\{[^{}]*\}\s*\{\s*=\s*\}|\\(?:triangleq|equiv|coloneqq|doteq)(?![A-Za-z])", "="),
        (r"\\[tdc]?frac\s*(?:\{\s*(\d+)\s*\}|(\d))\s*(?:\{\s*(\d+)\s*\}|(\d))", lambda m: f"({m[1] or m[2]}/{m[3] or m[4]})"),
        (r"\\[tdc]?frac\s*\{((?:[^{}]|\{[^{}]*\})*)\}\s*\{\s*(\d+)\s*\}", r"((\1)/\2)"),
        (r"(\d)\s*\\(?:cdot|times)\s*10\s*\^\s*\{?\s*([+-]?\d+)\s*\}?", r"\1e\2"),
        (r"\\(?:cdot|times|circ|ast(?=\s*[A-Za-z\\(\[]))(?![A-Za-z])", "·"),
        (r"\\(?:ast|star)(?![A-Za-z])", "*"),
        (r"\\(?:top|intercal|prime)(?![A-Za-z])", "ᵀ"),
        (r"\\(?:\||[lr]?Vert(?![A-Za-z]))", "‖"),
        (r"\\sqrt\s*\{", "√{"),
        (r"\\sqrt(?![A-Za-z{])", "√"),
    ]
)

# ------------------------------------------------------------------ the letters of LaTeX

_FONTS = r"mathcal|mathscr|mathfrak|mathbf|mathbb|mathsf|mathit|mathrm|mathtt|boldsymbol|bm|pmb|text|symbf|symbfit"
_GREEK = {
    "phi": "φ", "varphi": "φ", "psi": "ψ", "tau": "τ", "theta": "θ", "vartheta": "θ", "gamma": "γ", "Upsilon": "Υ", "Omega": "Ω",
    "Lambda": "Λ", "Delta": "Δ", "varUpsilon": "Υ", "varOmega": "Ω", "varLambda": "Λ", "varDelta": "Δ",
}  # fmt: skip
# Letters that another font makes another operator. 𝒱 alone is the velocity V; 𝒱 under an accent Ṽ or V̄.
_SCRIPT = {"mathcal M": "ℳ", "mathscr M": "ℳ", "mathscr B": "𝓑", "mathcal J": "𝒥", "mathscr J": "𝒥", "mathbb 1": "I", "mathbf 1": "I"}
_ACCENTS = {"tilde": "\u0303", "widetilde": "\u0303", "bar": "\u0304", "overline": "\u0304", "dot": "\u0307"}


def _font(found: re.Match[str]) -> str:
    font, letter = found[1], found[2] or found[3] or found[4]
    return _SCRIPT.get(f"{font} {letter}", letter)


def _accent(found: re.Match[str]) -> str:
    letter = found[2] or found[3]
    return unicodedata.normalize("NFC", letter[0] + _ACCENTS[found[1]] + letter[1:])


_LATEX_LETTERS = _rules(
    [
        (rf"\\({'|'.join(sorted(_GREEK, key=len, reverse=True))})(?![A-Za-z])", lambda m: _GREEK[m[1]]),
        (rf"\\({_FONTS})\s*(?:\{{\s*([^{{}}\\]+?)\s*\}}|(?<=\s)([^{{}}\\\s])|([^{{}}\\\sA-Za-z]))", _font),
        (r"\{\s*\\(cal|bf|rm|it|sf|scr)(?![A-Za-z])\s*([^\s{}\\])\s*\}", lambda m: _SCRIPT.get(f"math{m[1]} {m[2]}", m[2])),
        (rf"\\({'|'.join(_ACCENTS)})(?![A-Za-z])\s*(?:\{{\s*([^{{}}\\^_])\s*\}}|([^{{}}\\\s]))", _accent),
        (r"_\s*\{\s*([^\s{}])\s*\}", r"_\1"),
        (rf"\\({'|'.join(_ACCENTS)})(?![A-Za-z])\s*\{{\s*([^{{}}\\^_](?:_[^\s{{}}])?)()\s*\}}", _accent),
        (r"(?<![A-Za-z}])\{\s*([^\s{}^_+\-]|[^\s{}^]_[^\s{}])\s*\}(?=\s*[\^_])", r"\1"),
    ]
)

# ------------------------------------------------------------------ Unicode, and exponents however they are typed

_SUPERSCRIPTS = str.maketrans("⁰¹²³⁴⁵⁶⁷⁸⁹⁺⁻⁽⁾", "0123456789+-()")
_STARS = "*∗⋆＊"
_TRANSPOSES = "Tᵀ⊤⊺'′t"


def _exponent(found: re.Match[str]) -> str:
    """An exponent as suffixes: ^* for a transpose, ^-1 and the like for a power, ^½ for a root; -T is an inverse and a transpose."""
    raw = next(group for group in found.groups() if group is not None)
    inner = re.sub(r"[\s{}()]", "", raw.translate(_SUPERSCRIPTS)).replace("−", "-")
    if len(inner) == 1 and inner in _STARS + _TRANSPOSES:
        return " ^* "
    if inner in ("+", "-*", "-T", "*-1", "T-1", "-1*", "-1T") or re.fullmatch(rf"-[{_STARS}{_TRANSPOSES}]", inner):
        return " ^+ " if inner == "+" else " ^-1^* "
    if re.fullmatch(r"-?(1/2|½|0?\.50*)", inner):
        return " ^-½ " if inner[0] == "-" else " ^½ "
    if re.fullmatch(r"-?\d+", inner):
        return f" ^{inner} "
    return found[0]


_EXPONENTS = _rules(
    [
        (r"\^\s*\{((?:[^{}]|\{[^{}]*\})*)\}", _exponent),
        (r"\^\s*(\([^()]*\))", _exponent),
        (rf"\^\s*([-−⁻]?\s*(?:[{_STARS}{_TRANSPOSES}](?![A-Za-z])|½))", _exponent),
        (r"\^\s*([-−]?0?\.50*)(?!\d)", _exponent),
        (r"\^\s*([-−]\s*\d+)", _exponent),
        (r"\^\s*(\+)", _exponent),
        (rf"(⁻[{_STARS}{_TRANSPOSES}])", _exponent),
        (r"([⁻⁺]?[⁰¹²³⁴⁵⁶⁷⁸⁹]+|⁺)", _exponent),
        (r"([ᵀ⊤⊺′])", _exponent),
        (r"P\s*_?\s*\^\+", " P_plus "),
        (r"P\s*_\s*\+", " P_plus "),
    ]
)

_FRACTIONS = {"½": "(1/2)", "⅓": "(1/3)", "⅔": "(2/3)", "¼": "(1/4)", "¾": "(3/4)"}
_SIGNS = {"−": "-", "–": "-", "×": "·", "⋅": "·", "∙": "·", "∘": "·", "•": "·", "∗": "*", "⋆": "*", "≡": "=", "≜": "=", "≝": "=", "∆": "Δ"}
# Letters of other alphabets that stand for the book's: the symbol forms of φ, θ, Υ.
_VARIANTS = {"ϕ": "φ", "ϑ": "θ", "ϒ": "Υ", "Ω": "Ω", "𝓜": "ℳ", "𝒱": "V", "𝟙": "I"}


def _plain_letter(found: re.Match[str]) -> str:
    """Mathematical alphabets (𝒟, 𝐌, 𝜙, ℰ) as plain letters, but for those that are operators of their own (ℳ, 𝒥, 𝓑)."""
    letter = found[0]
    if letter in _OWN_LETTERS or letter in _VARIANTS:
        return _VARIANTS.get(letter, letter)
    plain = unicodedata.normalize("NFKC", letter)
    return _VARIANTS.get(plain, plain)


_OWN_LETTERS = {"ℳ"} | {s.text for s in _core.symbols if len(s.text) == 1 and not s.text.isascii()}
_LETTERS = [
    *sorted(((s.text, f" {s.name} ") for s in _core.symbols if not s.text.isascii()), key=lambda entry: -len(entry[0])),
    ("ℳ", " MM "),
]


def _no_combining(letter: str) -> str:
    return re.escape(unicodedata.normalize("NFC", letter)) + r"(?![\u0300-\u036f])"


_UNICODE = _rules(
    [
        (r"[\u2100-\u214f\U0001d400-\U0001d7ff]", _plain_letter),
        ("|".join(map(re.escape, _VARIANTS)), lambda m: _VARIANTS[m[0]]),
        (r"_\s*\{\s*([^{}\s]+)\s*\}", r"_\1"),
        (r"a_0(?!\d)", "a₀"),
        (r"θ\u0308", " vdot "),
        (r"(?<![A-Za-z])d\s*/\s*dt(?![A-Za-z])", "∂_t"),
        (r"∂\s*/\s*∂\s*θ\s*_\s*([ij])(?![A-Za-z])", r"∂_\1"),
        (r"Δ\s*_\s*t(?!heta)|(?<![A-Za-z_])Delta_t(?![A-Za-z_])", " Delta_theta_dot "),
        (r"Δ\s*_\s*([ij])", r" Delta(\1) "),
        (r"(?<![A-Za-z_])Delta_([ij])(?![A-Za-z_])", r" Delta(\1) "),
    ]
)
_NAMES = _rules(
    [
        (
            "|".join(map(re.escape, _FRACTIONS)),
            lambda m: f" {_FRACTIONS[m[0]]} " if m.start() == 0 or m.string[m.start() - 1] not in "^-" else m[0],
        ),
        ("|".join(map(re.escape, _SIGNS)), lambda m: _SIGNS[m[0]]),
        (r":=", "="),
        (r"‖([^‖]*)‖|\|\|([^|]*)\|\|", lambda m: f" norm({m[1] or m[2]}) "),
        *((_no_combining(letter), name) for letter, name in _LETTERS),
        (r"(?<![A-Za-z_])(?:ln|log)\s*\|\s*det\s*(\([^|]*\)|\[[^|]*\]|[^|]*)\|", lambda m: f" logdet({m[1]}) "),
        (r"(?<![A-Za-z_])(?:ln|log)\s*(?:\(\s*det\s*\(([^()]*)\)\s*\))", r" logdet(\1) "),
        (r"(?<![A-Za-z_])(?:ln|log)\s*\|?\s*det(?![A-Za-z_])", " logdet "),
        # a power belongs to what stands before it, as does a star that ends a factor
        (r"\s+(?=\*\*|\^)", ""),
        (r"\s+(?=\*\s*($|[)\]}=+\-*]))", ""),
        (r"(?<=\d)\s+(?=\*\*)", ""),
    ]
)


@lru_cache(maxsize=256)
def _spelled(typed: str) -> tuple[str, tuple[int, ...]]:
    spelled = Spelled(typed, typed, list(range(len(typed) + 1)))
    if re.search(r"\\\S", typed):
        spelled.apply(_LAYOUT)
        while spelled.apply(_LATEX_LETTERS):  # fonts and accents nest
            pass
    for table in (_UNICODE, _EXPONENTS, _NAMES):
        spelled.apply(table)
    return spelled.text, tuple(spelled.origins)


def spelled(text: str) -> Spelled:
    """A statement's text in the grammar's spelling. What no rule knows is left as it is, for the grammar to point at."""
    typed = unicodedata.normalize("NFC", text)
    new, origins = _spelled(typed)
    return Spelled(typed, new, list(origins))
