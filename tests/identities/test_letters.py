"""Letters beyond the table of operators: definitions around a statement, letters of the equations of motion, rates, nodes, determinants."""

from pathlib import Path

import numpy as np
import pytest

import pycraft as pc
from pycraft.identities.paper import check_paper
from pycraft.identities.parse import ParseError, Statements
from pycraft.proofs import prove

TYPED = [  # text, hypotheses under which it is true
    (r"\mathcal T = \mathcal M\ddot\theta + \mathcal C", {"J = 0"}),
    ("T = (ℳ + J)θ̈ + 𝒞", set()),
    (r"\mathcal T = H\phi[M\phi^*(H^*\ddot\theta + \mathfrak a) + \mathfrak b]", {"J = 0"}),
    (r"\alpha = \phi^*(H^*\ddot\theta + \mathfrak a)", set()),
    (r"\mathfrak f = \phi(M\alpha + \mathfrak b)", set()),
    (r"\epsilon = \mathcal T - b_J - Hz", set()),
    (r"\epsilon = \mathcal T - Hz", {"J = 0"}),
    (r"z = \psi[\mathcal{KT} + \mathcal P\mathfrak a + \mathfrak b]", {"J = 0"}),
    (r"\mathfrak f = \mathcal P(\alpha - \mathfrak a) + z", set()),
    (
        r"\ddot\theta = [I - H\psi\mathcal K]^*\mathcal D^{-1}[\mathcal T - H\psi(\mathcal{KT} + \mathcal{Pa} + \mathfrak b)]"
        r" - \mathcal K^*\psi^*\mathfrak a",
        {"J = 0"},
    ),
    ("[I-HψK]* ν - K*ψ* a = θ̈,  ν = D⁻¹(T - b_J - Hz),  z = ψ(K(T - b_J) + Pa + b)", set()),
    ("P⁺E*α + z + Gε = f", set()),
    ("α = α⁺ + H*θ̈ + a", set()),
    (r"\dot{\mathcal V} = \alpha", set()),
    ("ṗ + V̄p = f", set()),
    ("d(ℳθ̇)/dt = T + Ḣp - HV̄p", {"J = 0"}),
    (r"\frac{d}{dt}(\mathcal M\dot\theta) = \mathcal T - b_J - J\ddot\theta + \dot H p - H\bar{\mathcal V}p", set()),
    ("C θ̇ = 𝒞", set()),
    ("ℳ_dot - 2C = -(ℳ_dot - 2C)*", set()),
    (r"\dot{\mathcal M} - 2C = -(\dot{\mathcal M} - 2C)^*", set()),
    (r"\dot\phi = \tilde\phi\Delta_{\dot\theta}\phi", set()),
    ("d(φ*H*)/dt = φ*(Delta_theta_dot*phi_tilde*H* + Ḣ*)", set()),
    (r"\frac{\partial\mathcal M}{\partial\theta_i} = H\phi[\Delta_i\phi M + M\phi^*\Delta_i^*]\phi^*H^*", {"single-DOF hinges"}),
    ("∂ℳ/∂θ_k = Hφ[Δ_kφM + Mφ*Δ_k*]φ*H*", {"single-DOF hinges"}),
    (r"\frac{\partial\ln\det\mathcal M}{\partial\theta_i} = 2\,\mathrm{Tr}[\mathcal P\Upsilon\Delta_i]", {"J = 0", "single-DOF hinges"}),
    (r"\underline\Lambda^{-1} = \mathcal J\mathcal M^{-1}\mathcal J^*", {"J = 0"}),
    ("inv(Lambda(node0)) = Jacobian(node0) inv(MM) Jacobian(node0)^T", {"J = 0"}),
    (r"\det\mathcal M = \det\mathcal D", {"J = 0"}),
    ("det(ℳ + J)/det D = 1", set()),
    ("S := H*; Γ := E_φ*; G := φ*; G = inv(I - Γ)", set()),
    ("S := H*; G := φ*; MM = S^T G^T M G S", set()),
    ("x ∈ Θ; A := I + HφK; x*(MM + J)x = (A*x)* D A*x", set()),
]
CHECKED = [("η̇ + Sη = m⁻¹T,  S = m⁻¹Cm⁻* - ṁ*m⁻*", set())]  # proofs have no rule for the rate of a square root


@pytest.mark.parametrize(("text", "hypotheses"), TYPED, ids=[text for text, _ in TYPED])
def test_what_is_typed_is_proved_under_its_hypotheses(text, hypotheses):
    proof = prove(text)
    assert proof and {*proof.hypotheses} == hypotheses and proof.recheck()


@pytest.mark.parametrize(("text", "hypotheses"), TYPED + CHECKED, ids=[text for text, _ in TYPED + CHECKED])
def test_what_is_typed_is_decided(text, hypotheses):
    meets = "J = 0" in hypotheses
    model = pc.tree([-1, 0, 1, 2, 3, 4], ["pin", "slider", "pin", "screw", "pin", "pin"], seed=2, rotor_inertia=not meets)
    model.add_node("node0", "body5", position=(0.1, 0.2, 0.3))
    assert pc.check(text, model, states=2, search=False), text
    if hypotheses:  # and false where they are not met
        other = pc.tree([-1, 0, 0, 1], ["universal", "ball", "free", "ball"], seed=2, rotor_inertia=True)
        other.add_node("node0", "body2", position=(0.1, 0.2, 0.3))
        assert pc.check(text, other, states=2, search=False).verdict == "fails"


@pytest.mark.parametrize(
    "text", ["f = φ(Mα - b)", "ν = D⁻¹T", "ψ̇ = ψ̃Δ_θ̇ψ", "det ℳ = det M", "A := I - HφK; MM + J = A D A*", "α = α⁺ + H*θ̈"]
)
def test_what_is_false_fails(text):
    assert pc.check(text, states=4, search=False).verdict == "fails"


def test_values_are_those_of_the_direct_calls():
    """An oracle beside the algebra: inverse dynamics, forward dynamics and bias forces of the recursions."""
    arm = pc.tree([-1, 0, 1, 1], ["pin", "ball", "universal", "free"], seed=3, rotor_inertia=True)
    arm.hinges["hinge1"].rotor_inertia, arm.hinges["hinge3"].rotor_inertia = [0.3] * 3, [0.2] * 3 + [0.0] * 3  # no v ×* (J v)
    state = arm.random_state(seed=1)
    arm.q, arm.v = state.q, state.v
    vdot = np.random.default_rng(0).normal(size=arm.nv)
    values = {name: Statements(arm.soa).letter(name, []) for name in ("T", "C_force", "alpha", "f", "nu")}
    tau = np.asarray(values["T"].value(vdot=vdot)).ravel()
    bound = 1e-12 * np.abs(tau).max()  # some 100 roundings of the largest force
    assert np.abs(tau - arm.inverse_dynamics(arm.q, arm.v, vdot)).max() <= bound
    assert np.abs(np.asarray(values["C_force"].value()).ravel() - arm.bias_forces(arm.q, arm.v)).max() <= bound
    # H f is what of it the hinges hold: without the rotors
    held = np.asarray((arm.soa.H @ values["f"]).value(vdot=vdot)).ravel() + arm.soa.J.dense() @ vdot
    assert np.abs(held - tau).max() <= bound


def test_what_was_read_is_said_with_its_letters():
    said = pc.check("z = ψ(KT + Pa + b)", states=1, search=False).understood
    assert said == "z = ψ (K T + P a + b), where z = ψ(K (T - b_J) + P a + b); T = H f + J θ̈ + b_J; f = φ(M α + b); α = φ* (H* θ̈ + a)"
    assert "Γ" not in pc.check("A := I + HφK; MM + J = A D A*", states=1).understood


def test_definitions_in_all_readers():
    text = "A := I + HφK; ℳ + J = A D A*"
    assert pc.check(text, states=2) and pc.truth(text, smallest_case=False) and prove(text)
    wrong = "A := I + HφK; ℳ + J = A D A"
    near = pc.repair(wrong, most=1)
    assert near[0].statement == "ℳ + J = A D A*" and near[0].proof
    assert pc.check("A := φM; A(k,k) = M(k)", pc.chain(3), states=1)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("L := W; W := L; L = I", "defined by itself"),
        ("2A := φ; φ = φ", "is no name"),
        ("A := φ = ψ; A = φ", "stands for one expression"),
        ("Γ = φ", "no operator is called 'Gamma'; define it"),
        ("M̃ = φ", "M has no tilde in the book"),
        ("p̈ = f", "two dots over p"),
        ("ψ = φ; A = I", "is no definition"),
    ],
)
def test_what_is_no_definition_says_why(text, says):
    with pytest.raises(ParseError, match=says):
        pc.check(text, states=1)


BY_BLOCK = [
    r"\mathcal V(k) = \phi^*(\wp(k),k)\mathcal V(\wp(k)) + H^*(k)\dot\theta(k)",
    r"\alpha(k) = \phi^*(\wp(k),k)\alpha(\wp(k)) + H^*(k)\ddot\theta(k) + \mathfrak a(k)",
    r"\mathfrak f(k) = \sum_{j\in C(k)}\phi(k,j)\mathfrak f(j) + M(k)\alpha(k) + \mathfrak b(k)",
    r"z(k) = \sum_{j\in C(k)}\phi(k,j)z^+(j) + \mathcal P(k)\mathfrak a(k) + \mathfrak b(k)",
    r"\epsilon(k) = \mathcal T(k) - b_J(k) - H(k)z(k)",
    r"\mathcal P(k) = \phi(k,k-1)\mathcal P^+(k-1)\phi^*(k,k-1) + M(k)",
    r"\mathcal V(k) = \phi^*(k+1,k)\mathcal V(k+1) + H^*(k)\dot\theta(k)",
    r"\Upsilon(k) = \psi^*(k+1,k)\Upsilon(k+1)\psi(k+1,k) + H^*(k)\mathcal D^{-1}(k)H(k)",
    r"\det(\mathcal M + J) = \prod_{k=1}^n\det\mathcal D(k)",
    "ln det(ℳ + J) = Σ_k ln det D(k)",
    "V(k) = Σ_{j∈path(k)} φ*(j,k) H*(j) θ̇(j)",
    "R(k) = Σ_{j∈outboard(k)} φ(k,j) M(j) φ*(k,j)",
]


@pytest.mark.parametrize("text", BY_BLOCK)
def test_recursions_by_block(text):
    chain = pc.tree([-1, 0, 1, 2], ["pin", "ball", "universal", "slider"], seed=4, rotor_inertia=True)
    assert pc.check(text, chain, states=1)
    tree = pc.tree([-1, 0, 0, 1, 1], ["pin", "ball", "universal", "slider", "pin"], seed=4, rotor_inertia=True)
    if "k+1" in text or "k-1" in text:
        with pytest.raises(pc.EvaluationError, match="serial chains"):
            pc.check(text, tree, states=1)
    else:
        assert pc.check(text, tree, states=1)


def test_wrong_recursions_fail():
    chain = pc.tree([-1, 0, 1], ["pin", "ball", "universal"], seed=4, rotor_inertia=True)
    for text in (r"V(k) = \phi^*(k-1,k)V(k-1) + H^*(k)\dot\theta(k)", "det ℳ = ∏_k det D(k)", "V(k) = Σ_{j∈outboard(k)} H*(j) θ̇(j)"):
        try:
            assert pc.check(text, chain, states=1).verdict == "fails"
        except pc.SpaceError:
            pass


def test_a_paper_defines_its_letters(tmp_path):
    """A line with one unknown letter on its left defines it: for all lines of the paper."""
    paper = Path(tmp_path / "p.tex")
    rows = [
        r"\[ \mathcal M + J = L\mathcal D L^* \]",
        r"\[ L = I + H\phi\mathcal K \]",
        r"\[ \Gamma := \mathcal E_\phi^* \] \[ \phi^* = (I - \Gamma)^{-1} \]",
        r"\[ \mathfrak f = \phi(M\alpha + \mathfrak b) \]",
        r"\[ \mathcal P(k) = \sum_{j=1}^n \phi(k,j) M(j) \]",
        r"\[ W = \int_0^1 f\,dx \]",
    ]
    paper.write_text("\n".join(rows), encoding="utf-8")
    report = check_paper(paper, states=1, search=False)
    assert [(e.line, e.verdict) for e in report.equations] == [
        (1, "holds"), (2, "defines"), (3, "defines"), (3, "holds"), (4, "holds"), (5, "fails"), (6, "not read")
    ], repr(report)  # fmt: skip
    assert "where L = I + H φ K" in report.equations[0].understood


def test_letters_of_the_book_are_not_made_of_ones_own():
    """G is another letter here; P, which the book makes of its own G, is not changed, and neither is z, whose P and T are the book's."""
    assert pc.check("G := φ*; z = ψ(K(T - b_J) + Pa + b)", states=1, search=False)
    assert pc.check("T ∈ Θ; ε = T - b_J - Hψ(K(T - b_J) + Pa + b)", states=1, search=False)  # with this T, z is made of it
    assert pc.check(r"A := \psi\,P; A = \psi\, P", states=1, search=False)


def test_a_determinant_by_block_has_its_sign():
    """Blocks whose pivots are exchanged an odd number of times: of a permutation of two rows det is -1."""
    from pycraft.identities.block_values import _pivots

    for n in (2, 3, 5):
        x = np.random.default_rng(n).normal(size=(n, n))[::-1].copy()
        assert np.prod(_pivots(x)) == pytest.approx(np.linalg.det(x), rel=1e-12)


@pytest.mark.parametrize("text", BY_BLOCK)
def test_recursions_are_proved(text):
    if "path" in text or "outboard" in text:
        with pytest.raises(ParseError, match="without a form in operators"):
            prove(text)
    else:
        assert prove(text) and not prove(text).hypotheses


@pytest.mark.parametrize(
    "text",
    [
        "V*(k)f(k) = V*(k)f(k)",  # of every body, where V*f is the sum
        "A := φ*H*; A*(k)P(k)A(k) = A*(k)P(k)A(k)",
        "φ(k) = φ(k)",
        "Ω(i,j) = Υ(i)ψ(i,j), i above j",
        "Σ_{j∈C(k)} V(j) = V(k)",
    ],
)
def test_what_is_no_statement_of_operators_is_not_proved_as_one(text):
    with pytest.raises(ParseError, match="without a form in operators"):
        prove(text)


def test_wrong_recursions_are_not_proved():
    for text in ("V(k) = φ*(℘(k),k)V(℘(k)) - H*(k)θ̇(k)", "Υ(k) = ψ*(℘(k),k)Υ(℘(k))ψ(℘(k),k)", "det ℳ = ∏_k det M(k)", "P(k) = M(k)"):
        assert not prove(text)


SCHOOLS = [  # dialect, text, hypotheses under which it is true
    ("Park", r"G = (I-\Gamma)^{-1}", set()),
    ("Park", "M = S^T G^T J G S", set()),
    ("Park", r"\dot V = G(S\ddot q + \mathrm{ad}_{S\dot q}\Gamma V)", {"constant H"}),
    ("Park", r"F = G^T(J\dot V - \mathrm{ad}_V^* J V)", set()),
    ("Park", r"\tau = M\ddot q + C\dot q", {"constant H"}),
    ("Saha", "I = N_d^T N_l^T M N_l N_d", set()),
    ("Saha", "I = UDU^T", {"J = 0"}),
    ("Saha", r"t = N_l N_d\dot q", set()),
    ("Saha", r"I\ddot q + h = \tau", set()),
    ("Saha", r"C = N^T(M\dot N + WMN)", set()),
    ("Featherstone", r"H = \sum_i J_i^T I_i J_i", set()),
    ("Featherstone", r"\Lambda^{-1} = JH^{-1}J^T", {"J = 0"}),
    ("Featherstone", r"\tau = H\ddot q + C", set()),
    ("Featherstone", r"v_i = {}^iX_{\lambda(i)} v_{\lambda(i)} + S_i\dot q_i", set()),
    ("Featherstone", "U_i = I_i^A S_i", set()),
    ("Featherstone", r"\tau_i = S_i^T f_i", set()),
    ("Khatib", r"\bar J = A^{-1}J^T\Lambda", set()),
    ("Khatib", r"A\ddot q + b + g = \Gamma", set()),
    ("Khatib", r"\Lambda = (JA^{-1}J^T)^{-1}", {"J = 0"}),
    ("Khatib", r"N\bar J = 0", {"J = 0"}),
    ("Wensing", r"\dot H = C + C^T", set()),
    ("Wensing", r"C = J^T(I\dot J + BJ)", set()),
    ("Mueller", "J = AX", set()),
    ("Mueller", r"\dot J = -AaJ", {"single-DOF hinges"}),
    ("Mueller", r"C = -J^T(MAa + b^TM)J", {"single-DOF hinges"}),
]


@pytest.mark.parametrize(("dialect", "text", "hypotheses"), SCHOOLS, ids=[f"{d}: {t}" for d, t, _ in SCHOOLS])
def test_equations_of_other_schools(dialect, text, hypotheses):
    proof = prove(text, dialect=dialect)
    assert proof and {*proof.hypotheses} == hypotheses
    model = pc.tree([-1, 0, 1, 2, 3, 4], ["pin", "slider", "pin", "screw", "pin", "pin"], seed=2)
    model.gravity = (1.0, 2.0, -9.8)
    assert pc.check(text, model, states=1, search=False, dialect=dialect)


@pytest.mark.parametrize(
    ("dialect", "text"),
    [
        ("Park", "M = S^T G J G S"),
        ("Khatib", r"J\bar J = 0"),
        ("Mueller", r"\dot J = AaJ"),
        ("Saha", "I = U^T D U"),
        ("Wensing", r"\dot H = C - C^T"),
    ],
)
def test_wrong_equations_of_other_schools(dialect, text):
    try:
        assert pc.check(text, states=2, search=False, dialect=dialect).verdict == "fails"
    except ParseError as error:
        assert "maps" in str(error)  # spaces that do not fit


def test_both_letters_are_shown():
    report = pc.check("M = S^T G^T J G S", states=1, dialect="Park")
    assert report.statement == "dialect Park; M = S^T G^T J G S" and report.understood.startswith("H φ M φ* H* =")
    assert pc.truth("M = S^T G^T J G S", smallest_case=False, dialect="Park") and pc.check(report.statement, states=1)
    assert pc.repair("M = S^T G^T J G S^T", most=1, dialect="Park")[0].proof
    with pytest.raises(ParseError, match="no dialect is called 'Parc'; there are Featherstone, Khatib"):
        pc.check("M = M", dialect="Parc")


def test_a_paper_in_a_dialect(tmp_path):
    paper = Path(tmp_path / "p.tex")
    paper.write_text(r"\[ L = I - \Gamma \] \[ G = L^{-1} \] \[ M = S^T G^T J G S \]", encoding="utf-8")
    assert [e.verdict for e in check_paper(paper, states=1, dialect="Park").equations] == ["defines", "holds", "holds"]


def test_a_forgotten_star_is_called_so():
    from pycraft.proofs import exercise

    task = exercise("HψMψ*H* == D", blank=2)
    answer = task.answer("HψPH* + HPψH* - D")
    assert answer.verdict == "wrong" and answer.text == "spaces do not fit: star missing on ψ, in the second term"
    assert task.answer("HψPψH* + HPψH* - D").verdict == "unreadable"  # two slips


def test_true_under_hypotheses_has_its_own_sign():
    shown = pc.check("HψMψ*H* = D", states=1)._repr_html_()
    assert "◐ true where J = 0" in shown and "✗" not in shown
    assert "not met" not in str(prove("ℳ⁻¹ = [I-HψK]*D⁻¹[I-HψK]"))  # there is no model that could meet it


HYBRID = [
    "ℳ_pp - ℳ_pf(ℳ_ff)⁻¹ℳ_fp = H_pY*MYH_p*,  Y = ψ_f* - Ω_fP_f",
    "(ℳ_ff+J_f)⁻¹ℳ_fp = (K_f*ψ_f* + [I-H_fψ_fK_f]*D_f⁻¹H_fψ_fP_f)H_p*",
    "𝒥_p - 𝒥_f(ℳ_ff+J_f)⁻¹ℳ_fp = (ψ_f* - Ω_fP_f)H_p*",
    "ln det ℳ = ln det ℳ_ff + ln det(ℳ_pp - ℳ_pf(ℳ_ff)⁻¹ℳ_fp)",
    "[I-H_fψ_fK_f]*ν_f - K_f*ψ_f*L = θ̈_f,  L = a + H_p*θ̈_p",
    "T_p = H_p(P_f(ψ_f*(H_f*ν_f + L) - L) + z_f),  L = a + H_p*θ̈_p",
]


@pytest.mark.parametrize("text", HYBRID)
def test_letters_of_hybrid_dynamics(text):
    model = pc.tree([-1, 0, 0, 1], ["pin", "ball", "slider", "universal"], seed=1)
    assert pc.check(text, model, states=1, search=False) and prove(text)
    if "θ" not in text and "T" not in text and "ln" not in text:  # these have no vectors, and ℳ is ℳ_ff
        assert pc.check(text, model.soa.free(["hinge0"]), states=1, search=False)


def test_letters_of_loops():
    bars = pc.chain(3)
    bars.add_loop("body2", hinge="pin", point=(1, 0, 0), name="closure")
    bars.q = bars.assemble([1.0, -1.4, -1.5], fix="hinge0").q
    assert pc.check("Qℳ⁻¹Q* = Q[I-HψK]*D⁻¹[I-HψK]Q*", bars, states=1, search=False)
    assert pc.check("Qℳ⁻¹Q* = Q[I-HψK]*D⁻¹[I-HφK]Q*", bars, states=1, search=False).verdict == "fails"
    with pytest.raises(pc.ModelError, match="has no loops"):
        pc.check("Q = Q", pc.chain(3))
