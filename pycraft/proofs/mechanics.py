"""The axioms of motion, and lemmas from them: like `axioms` for a tree of matrices, for velocities of rigid bodies.

Ṽ acts on motions as V̄ on forces, up to the sign and the star; the cross product of a vector with itself is zero; and the cross of a body's
velocity splits into the parent's, carried over, and the hinge's: Ṽ φ*(p,k) = φ*(p,k) Ṽ(p) - Δ_θ̇* φ*(p,k), since a
change of frame carries crosses to crosses, crm(φ*x) φ* = φ* crm(x), and Δ_θ̇* = -crm(H*θ̇).
"""

from __future__ import annotations

AXIOMS = [
    "V̄ = − Ṽ*",
    "Ṽ V = 0",
    "𝓑 V = V̄ M V",
    "𝓑* = − 𝓑",
    "Δ_θ̇* H* θ̇ = 0",
    "Ṽ E_φ* = E_φ* Ṽ − Δ_θ̇* E_φ*",
]
DEFINITIONS = ["V = φ* H* θ̇", "a = Ṽ H* θ̇ + Ḣ* θ̇", "b = V̄ M V", "γ = − φ* a₀"]

# As in `axioms`: each with the words to replace, and by which equations.
LEMMAS: list[tuple[str, list[tuple[str, str]]]] = [
    ("Ṽ φ* H* θ̇ = 0", [("φ* H* θ̇", "V = φ* H* θ̇"), ("Ṽ V", "Ṽ V = 0")]),
    ("𝓑 φ* H* θ̇ = − Ṽ* M φ* H* θ̇", [("φ* H* θ̇", "V = φ* H* θ̇"), ("𝓑 V", "𝓑 V = V̄ M V"), ("V̄", "V̄ = − Ṽ*")]),
    (
        "Δ_θ̇* φ* = Δ_θ̇* + E_φ* Ṽ φ* − Ṽ φ* + Ṽ",
        [("E_φ* Ṽ", "Ṽ E_φ* = E_φ* Ṽ − Δ_θ̇* E_φ*"), ("E_φ* φ*", "(φ E_φ = φ − I)*")],
    ),
    (
        "Δ_θ̇* H* K* ψ* = Δ_θ̇* − Δ_θ̇* ψ* + E_φ* Ṽ ψ* − Ṽ ψ* + Ṽ − Ṽ H* K* ψ*",
        [("E_φ* Ṽ", "Ṽ E_φ* = E_φ* Ṽ − Δ_θ̇* E_φ*"), ("E_φ* ψ*", "(ψ E_φ = ψ − I + ψ K H)*")],
    ),
]

# (the replaced word, the equation), in order of rank.
ABBREVIATIONS = [("V", "V = φ* H* θ̇"), ("γ", "γ = − φ* a₀")]
VELOCITIES = [
    ("a", "a = Ṽ H* θ̇ + Ḣ* θ̇"),
    ("b", "b = V̄ M V"),
    ("V̄", "V̄ = − Ṽ*"),
    ("𝓑*", "𝓑* = − 𝓑"),
    ("Ṽ φ* H* θ̇", "Ṽ φ* H* θ̇ = 0"),
    ("Δ_θ̇* H* θ̇", "Δ_θ̇* H* θ̇ = 0"),
    ("𝓑 φ* H* θ̇", "𝓑 φ* H* θ̇ = − Ṽ* M φ* H* θ̇"),
    ("Δ_θ̇* E_φ*", "Ṽ E_φ* = E_φ* Ṽ − Δ_θ̇* E_φ*"),
    ("Δ_θ̇* φ*", "Δ_θ̇* φ* = Δ_θ̇* + E_φ* Ṽ φ* − Ṽ φ* + Ṽ"),
    ("Δ_θ̇* H* K* ψ*", "Δ_θ̇* H* K* ψ* = Δ_θ̇* − Δ_θ̇* ψ* + E_φ* Ṽ ψ* − Ṽ ψ* + Ṽ − Ṽ H* K* ψ*"),
]
NAMES = {"Ṽ", "V̄", "𝓑", "Δ_θ̇", "Ḣ"}
"""Letters that cause a and b to be expanded, and these rules to be used."""
WEIGHTS = {"V": 9, "γ": 19, "a": 29, "b": 39, "V̄": 9, "𝓑": 20, "Δ_θ̇": 12, "Ṽ": 1}
