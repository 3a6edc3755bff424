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


_GROUP = r"\{((?:[^{}]|\{(?:[^{}]|\{(?:[^{}]|\{[^{}]*\})*\})*\})*)\}"
"""Braces of LaTeX with what stands in them, other braces too."""
_ALONG = r"\\partial\s*\{?\s*\\(?:theta|beta|q)\s*_\s*\{?\s*([a-n])\s*\}?\s*\}?"
_INDEX = r"\{?\s*(?:θ|\\theta)\s*_\s*\{?\s*([a-n])\s*\}?\s*\}?"


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


def _derived(found: re.Match[str]) -> str:
    r"""What stands behind the d of \frac{dX}{dt}, the ∂ of \frac{\partial X}{\partial\theta_i}."""
    return re.sub(r"^\s*(?:\\partial(?:\s*\^\s*\{?2\}?)?|(?:\\mathrm\s*)?\{\s*d\s*\}|\\mathrm\s+d|d)", "", found[1]).strip()


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
        (r"\\partial\s*_\s*\{\s*\\(?:mathrm|text)\s*\{\s*mass\s*\}\s*\}", " ∂_mass "),
        (r"_\{\\(?:mathrm|text|textrm|mathit)\{((?:[^{}\\]|\\.)+)\}\}", _arguments),
        (r"\\(?:operatorname\*?|mathrm|text|textrm|textnormal|mathsf|mathit|mathbf)\s*\{\s*([A-Za-z]{2,})\s*\}", _word),
        (r"\\(?:ln|log)(?![A-Za-z])", " ln "),
        (r"\\[tdc]?frac\s*\{\s*(?:\\mathrm\s*)?\{?\s*d\s*\}?\s*\}\s*\{\s*(?:\\mathrm\s*)?\{?\s*d\s*\}?\s*t\s*\}", " ∂_t "),
        (rf"\\[tdc]?frac\s*\{{\s*\\partial\s*\}}\s*\{{\s*{_ALONG}\s*\}}", r" ∂_\1 "),
        (
            rf"\\[tdc]?frac\s*(?=\{{\s*\\partial\s*\^){_GROUP}\s*\{{\s*{_ALONG}\s*{_ALONG}\s*\}}",
            lambda m: f"(∂_{m[2]} ∂_{m[3]} ({_derived(m)}))",
        ),
        (rf"\\[tdc]?frac\s*(?=\{{\s*\\partial(?![A-Za-z])){_GROUP}\s*\{{\s*{_ALONG}\s*\}}", lambda m: f"(∂_{m[2]} ({_derived(m)}))"),
        (
            rf"\\[tdc]?frac\s*(?=\{{\s*(?:\\mathrm\s*)?\{{?\s*d\s*\}}?){_GROUP}\s*\{{\s*(?:\\mathrm\s*)?\{{?\s*d\s*\}}?\s*t\s*\}}",
            lambda m: f"(∂_t ({_derived(m)}))",
        ),
        (rf"\\partial\s*_\s*\{{\s*{_INDEX}\s*\}}", r" ∂_\1 "),
        (r"\\partial(?![A-Za-z])", "∂"),
        (r"\\wp(?![A-Za-z])", "℘"),
        (r"\\prod(?![A-Za-z])", "∏"),
        (r"\\sum(?![A-Za-z])", "Σ"),
        (r"\\geq?(?![A-Za-z])|\\succeq(?![A-Za-z])", "≥"),
        (r"\\leq?(?![A-Za-z])|\\preceq(?![A-Za-z])", "≤"),
        (r"\\succ(?![A-Za-z])|\\gt(?![A-Za-z])", ">"),
        (r"\\prec(?![A-Za-z])|\\lt(?![A-Za-z])", "<"),
        (r"\\ddot\s*\{?\s*\\theta(?![A-Za-z])\s*\}?", " θ\u0308 "),
        (r"\\(det|[Tt]r)(?![A-Za-z])", _word),
        (r"\\(?:stackrel|overset)\s*\{[^{}]*\}\s*\{\s*=\s*\}|\\(?:triangleq|equiv|coloneqq|doteq)(?![A-Za-z])", "="),
        (r"\\[tdc]?frac\s*(?:\{\s*(\d+)\s*\}|(\d))\s*(?:\{\s*(\d+)\s*\}|(\d))", lambda m: f"({m[1] or m[2]}/{m[3] or m[4]})"),
        (r"\\[tdc]?frac\s*\{((?:[^{}]|\{[^{}]*\})*)\}\s*\{\s*(\d+)\s*\}", r"((\1)/\2)"),
        (rf"\\[tdc]?frac\s*{_GROUP}\s*{_GROUP}", r"((\1)/(\2))"),
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
    "alpha": "α", "beta": "β", "delta": "δ", "epsilon": "ε", "varepsilon": "ε", "zeta": "ζ", "eta": "η", "iota": "ι", "kappa": "κ",
    "lambda": "λ", "mu": "μ", "nu": "ν", "xi": "ξ", "pi": "π", "rho": "ρ", "varrho": "ρ", "sigma": "σ", "chi": "χ", "omega": "ω",
    "Gamma": "Γ", "Xi": "Ξ", "Phi": "Φ", "Psi": "Ψ", "varGamma": "Γ", "varXi": "Ξ", "varPhi": "Φ", "varPsi": "Ψ",
}  # fmt: skip
# Letters that another font makes another operator. 𝒱 alone is the velocity V; 𝒱 under an accent Ṽ or V̄.
_SCRIPT = {
    "mathcal C": "𝒞",
    "mathscr C": "𝒞",
    "mathcal M": "ℳ",
    "mathscr M": "ℳ",
    "mathscr B": "𝓑",
    "mathcal J": "𝒥",
    "mathscr J": "𝒥",
    "mathbb 1": "I",
    "mathbf 1": "I",
}
_ACCENTS = {
    "tilde": "\u0303", "widetilde": "\u0303", "bar": "\u0304", "overline": "\u0304", "dot": "\u0307", "ddot": "\u0308",
    "hat": "\u0302", "widehat": "\u0302", "underline": "\u0332", "underbar": "\u0332", "check": "\u030c", "breve": "\u0306",
}  # fmt: skip


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
        (rf"\\({'|'.join(_ACCENTS)})(?![A-Za-z])\s*(?:\{{\s*([^{{}}\\^_][\u0300-\u036f]*)\s*\}}|([^{{}}\\\s][\u0300-\u036f]*))", _accent),
        (r"_\s*\{\s*([^\s{}])\s*\}", r"_\1"),
        (rf"\\({'|'.join(_ACCENTS)})(?![A-Za-z])\s*\{{\s*([^{{}}\\^_](?:_[^\s{{}}])?)()\s*\}}", _accent),
        (r"(?<![A-Za-z}])\{\s*([^\s{}^_+\-]|[^\s{}^]_[^\s{}])\s*\}(?=\s*[\^_])", r"\1"),
    ]
)

# What is left under an accent is more than a letter: a dot over a product is its rate.
_RATES = _rules([(rf"\\dot(?![A-Za-z])\s*{_GROUP}", r"(∂_t(\1))"), (r"\\vec(?![A-Za-z])\s*", "")])

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
        (r"([PVαzf])(\u0307?)\s*_?\s*\^\+", r" \1_plus\2 "),
        (r"([PVαzf])(\u0307?)\s*_\s*\+", r" \1_plus\2 "),
    ]
)

_FRACTIONS = {"½": "(1/2)", "⅓": "(1/3)", "⅔": "(2/3)", "¼": "(1/4)", "¾": "(3/4)"}
_SIGNS = {
    "−": "-", "–": "-", "×": "·", "⋅": "·", "∙": "·", "∘": "·", "•": "·", "∗": "*", "⋆": "*", "≡": "=", "≜": "=", "≝": "=", "∆": "Δ",
    "≻": ">", "⪰": "≥", "≽": "≥", "⩾": "≥", "≺": "<", "⪯": "≤", "≼": "≤", "⩽": "≤",
}  # fmt: skip
# Letters of other alphabets that stand for the book's: the symbol forms of φ, θ, Υ.
_VARIANTS = {"ϕ": "φ", "ϑ": "θ", "ϒ": "Υ", "Ω": "Ω", "𝓜": "ℳ", "𝒱": "V", "𝟙": "I"}


def _plain_letter(found: re.Match[str]) -> str:
    """Mathematical alphabets (𝒟, 𝐌, 𝜙, ℰ) as plain letters, but for those that are operators of their own (ℳ, 𝒥, 𝓑)."""
    letter = found[0]
    if letter in _OWN_LETTERS or letter in _VARIANTS:
        return _VARIANTS.get(letter, letter)
    plain = unicodedata.normalize("NFKC", letter)
    return _VARIANTS.get(plain, plain)


_OWN_LETTERS = {"ℳ", "𝒞"} | {s.text for s in _core.symbols if len(s.text) == 1 and not s.text.isascii()}
_LETTERS = [
    *sorted(((s.text, f" {s.name} ") for s in _core.symbols if not s.text.isascii()), key=lambda entry: -len(entry[0])),
    ("ℳ", " MM "),
    ("𝒞", " C_force "),
]


_OTHER_GREEK = {
    "α": "alpha", "β": "beta", "δ": "delta", "ε": "epsilon", "ϵ": "epsilon", "ζ": "zeta", "η": "eta", "ι": "iota", "κ": "kappa",
    "λ": "lamda", "μ": "mu", "µ": "mu", "ν": "nu", "ξ": "xi", "π": "pi", "ρ": "rho", "σ": "sigma", "χ": "chi", "ω": "omega",
    "Γ": "Gamma", "Ξ": "Xi", "Φ": "Phi", "Ψ": "Psi",
}  # fmt: skip
"""Greek letters that the table has not; lambda is a word of Python's, lamda is Unicode's name of the letter."""
GREEK = {*_OTHER_GREEK.values()}
"""Names of Greek letters that stand for nothing by themselves."""
_ACCENT_NAMES = {
    "\u0303": "_tilde", "\u0304": "_bar", "\u0305": "_bar", "\u0307": "_dot", "\u0308": "_ddot", "\u0302": "_hat", "\u0332": "_underline",
    "\u030c": "_check", "\u0306": "_breve",
}  # fmt: skip
_IN_ASCII = {**{unicodedata.normalize("NFC", letter): name for letter, name in _LETTERS}, **_OTHER_GREEK}
_SUBSCRIPT = r"((?:_(?:plus|\d+|\w))?)"


def _apart(found: re.Match[str]) -> str:
    """Split a letter and its accents into characters, except those of the table."""
    letter = found[0]
    return letter if letter in _IN_ASCII else unicodedata.normalize("NFD", letter)


def _accented(found: re.Match[str]) -> str:
    """ℳ with a dot as MM_dot, ẋ_1 as x_1_dot."""
    letter, subscript, accents = found[1], found[2] + found[4], found[3]
    base, rest = letter[0], letter[1:]
    while base + rest not in _IN_ASCII and rest:
        rest = rest[:-1]
    named = _IN_ASCII.get(base + rest, base + rest).strip()
    endings = "".join(_ACCENT_NAMES[a] for a in letter[len(base + rest) :] + accents)
    return f" {named}{subscript}{endings} "


def _only_others(found: re.Match[str]) -> str:
    """`_accented`, of what is no letter of the table."""
    return found[0] if unicodedata.normalize("NFC", found[0]) in _IN_ASCII else _accented(found)


def _no_combining(letter: str) -> str:
    return re.escape(unicodedata.normalize("NFC", letter)) + r"(?![\u0300-\u036f])"


_UNICODE = _rules(
    [
        (r"[\u2100-\u214f\U0001d400-\U0001d7ff]", _plain_letter),
        ("|".join(map(re.escape, _VARIANTS)), lambda m: _VARIANTS[m[0]]),
        (r"([Σ∑∏Π])\s*_\s*\{?\s*([c-z])\s*=\s*1\s*\}?\s*\^\s*\{?\s*[nN]\s*\}?", r"\1_\2 "),
        (r"_\s*\{\s*([^{}\s]+)\s*\}", r"_\1"),
        (r"[\u00c0-\u024f\u1e00-\u1eff]", _apart),
        (r"Λ\u0332", "Λ"),
        (r"a_0(?!\d)", "a₀"),
        (r"θ\u0308_([fpr])(?![a-z])", r" vdot_\1 "),
        (r"θ\u0307_r(?![a-z])", " theta_dot_r "),
        (r"θ(?:\u0308|\s*_ddot(?![A-Za-z]))", " vdot "),
        (r"θ\s*_dot(?![A-Za-z])", " theta_dot "),
        (r"(?<![A-Za-z])d\s*/\s*dt(?![A-Za-z])", "∂_t"),
        (r"∂\s*/\s*∂\s*θ\s*_\s*([a-n])(?![A-Za-z])", r"∂_\1"),
        (r"(?<![A-Za-z_])d(\((?:[^()]|\((?:[^()]|\([^()]*\))*\))*\))\s*/\s*dt(?![A-Za-z])", r"(∂_t\1)"),
        (r"(?<![A-Za-z_])d\s*([^\s/()+\-=,]+)\s*/\s*dt(?![A-Za-z])", r"(∂_t(\1))"),
        (r"∂((?:[^/∂=;,()]|\((?:[^()]|\([^()]*\))*\))+)/\s*∂\s*θ\s*_\s*([a-n])(?![A-Za-z])", r"(∂_\2(\1))"),
        (r"∂_θ_([a-n])(?![A-Za-z])", r"∂_\1"),
        (r"Δ\s*_\s*t(?!heta)|(?<![A-Za-z_])Delta_t(?![A-Za-z_])", " Delta_theta_dot "),
        (r"Δ\s*_\s*X(?![a-z])", " Delta_X "),
        (r"Δ\s*_\s*([a-n])(?![a-z0-9])", r" Delta(\1) "),
        (r"(?<![A-Za-z_])Delta_([a-n])(?![A-Za-z_])", r" Delta(\1) "),
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
        (r">=", "≥"),
        (r"<=(?!=)", "≤"),
        (r"‖([^‖]*)‖|\|\|([^|]*)\|\|", lambda m: f" norm({m[1] or m[2]}) "),
        # what bears an accent that makes no letter of the table: first those of two characters, φ̃ with a dot
        (rf"([^\W\d_](?:\u0303|\u0304|\u0307)?){_SUBSCRIPT}([{''.join(_ACCENT_NAMES)}]+){_SUBSCRIPT}", _only_others),
        *((_no_combining(letter), name) for letter, name in _LETTERS),
        (rf"([{''.join(_OTHER_GREEK)}]){_SUBSCRIPT}", lambda m: f" {_OTHER_GREEK[m[1]]}{m[2]} "),
        (r"\s+(?=_(?:(?:dot|ddot|tilde|bar|hat|plus)(?![A-Za-z])|(?:ff|fp|pf|pp|[fpwcnrgsSJ2])(?![a-z0-9])))", ""),
        (r"(?<![A-Za-z_])(?:ln|log)\s*\|\s*det\s*(\([^|]*\)|\[[^|]*\]|[^|]*)\|", lambda m: f" logdet({m[1]}) "),
        (r"(?<![A-Za-z_])(?:ln|log)\s*(?:\(\s*det\s*\(([^()]*)\)\s*\))", r" logdet(\1) "),
        (r"(?<![A-Za-z_])(?:ln|log)\s*\|?\s*det(?![A-Za-z_])", " logdet "),
        # a power belongs to what stands before it, as does a star that ends a factor
        (r"\s+(?=\*\*|\^)", ""),
        (r"\s+(?=\*\s*($|[)\]}=+\-*]))", ""),
        (r"(?<=\d)\s+(?=\*\*)", ""),
    ]
)


_OF_COORDINATE = re.compile(r"(?<=∂_)[a-n](?![a-z0-9_])|(?<=Delta\()[a-n](?=\))|(?<=(?<![a-z])e_)[a-n](?![A-Za-z0-9_])")


def _rename_indices(spelled: Spelled) -> None:
    """Coordinates by any letters as i and j, in the order in which they stand: ∂_k alone is ∂_i."""
    found = list(dict.fromkeys(_OF_COORDINATE.findall(spelled.text)))
    if len(found) <= 2 and not {*found} <= {"i", "j"}:
        spelled.rewrite((_OF_COORDINATE, lambda m: "ij"[found.index(m[0])]))


def stars_behind_nodes(source: Spelled, names: Iterable[str]) -> None:
    """B*(node0) as B(node0)*: a star between a letter of nodes and the names, or numbers, of nodes."""
    node = "|".join([r"\d+", *(re.escape(name) for name in sorted(names, key=len, reverse=True))])
    node = rf"\s*['\"]?(?:{node})['\"]?\s*"
    pattern = rf"(?<![A-Za-z_])(B|Jacobian|Lambda)\s*(\^\s*\*|\^\s*T(?![A-Za-z])|\*|'|\.T)\s*(\({node}(?:,{node})*\))"
    source.rewrite((re.compile(pattern), r"\1\3^*"))


@lru_cache(maxsize=256)
def _spelled(typed: str) -> tuple[str, tuple[int, ...]]:
    spelled = Spelled(typed, typed, list(range(len(typed) + 1)))
    if re.search(r"\\\S", typed):
        spelled.apply(_LAYOUT)
        while spelled.apply(_LATEX_LETTERS):  # fonts and accents nest
            pass
        spelled.apply(_RATES)
    for table in (_UNICODE, _EXPONENTS, _NAMES):
        spelled.apply(table)
    _rename_indices(spelled)
    return spelled.text, tuple(spelled.origins)


def spelled(text: str) -> Spelled:
    """A statement's text in the grammar's spelling. What no rule knows is left as it is, for the grammar to point at."""
    typed = unicodedata.normalize("NFC", text)
    new, origins = _spelled(typed)
    return Spelled(typed, new, list(origins))
