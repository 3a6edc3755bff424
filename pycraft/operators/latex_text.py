"""Plain text in LaTeX formulas: letters of the algebra as mathematics, since text fonts may lack them."""

from __future__ import annotations

MATHEMATICS = {
    **{
        "Θ": r"\Theta",
        "φ": r"\phi",
        "ψ": r"\psi",
        "τ": r"\tau",
        "θ": r"\theta",
        "γ": r"\gamma",
        "ν": r"\nu",
        "Υ": r"\Upsilon",
        "Ω": r"\Omega",
    },
    **{"Λ": r"\Lambda", "Δ": r"\Delta", "ℳ": r"\mathcal{M}", "𝒥": r"\mathcal{J}", "𝓑": r"\mathcal{B}", "∂": r"\partial", "√": r"\surd"},
    **{"−": "-", "·": r"\cdot", "×": r"\times", "‖": r"\Vert", "½": r"\frac12", "≥": r"\geq", "≤": r"\leq", "ℓ": r"\ell"},
    **{"⁻": "{}^-", "⁺": "{}^+", "¹": "{}^1", "²": "{}^2", "³": "{}^3", "ᵀ": r"{}^\top"},
    **{letter: f"{{}}_{digit}" for digit, letter in enumerate("₀₁₂₃₄₅₆₇₈₉")},
}
"""Letters that LaTeX fonts may lack, as mathematics."""


def escaped(text: str) -> str:
    """Return plain text for LaTeX's \\text: letters of the algebra as mathematics."""
    text = text.replace("\\", "").replace("_", "\\_").replace("⁻¹", "$^{-1}$").replace("*", "$^*$")
    for letter, latex in MATHEMATICS.items():
        text = text.replace(letter, f"${latex}$")
    return text.replace("$$", "")
