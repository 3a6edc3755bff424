"""Arithmetic of operators and their values: products, sums, inverses, constants, vectors, scalars, bound states, adjoints.

Tolerances are the running bounds of `formulas`.
"""

import numpy as np
import pytest

import pycraft as pc
from support.formulas import EPS, LETTERS, Formula, letters_of, norm
from support.mechanisms import every_kind, nodes_of, uniform_batch
from support.oracle import reference
from support.random_formulas import draw, seeded


@pytest.fixture(scope="module")
def model():
    return every_kind(rotor_inertia=True)


@pytest.fixture(scope="module")
def letters(model):
    return letters_of(model)


def check(formula):
    formula.assert_close(formula.op.dense())
    formula.assert_applies(np.random.default_rng(0))


# ---------------------------------------------------------------------- arithmetic


FORMULAS = {
    "product with @": lambda o: o.H @ o.phi @ o.M,
    "product with *": lambda o: o.H * o.phi * o.M * o.phi.T * o.H.T,
    "sum": lambda o: o.phi + o.psi,
    "difference": lambda o: o.P - o.M - o.P_plus,
    "negative": lambda o: -(o.H @ o.phi),
    "scaled from both sides": lambda o: 2 * o.M * -3.5,
    "quotient": lambda o: o.R / 4,
    "transpose of a product": lambda o: (o.H @ o.phi @ o.K @ o.D).T,
    "transpose of a sum": lambda o: (o.G - 2 * o.K).T,
    "transpose twice": lambda o: (o.H @ o.psi).T.T,
    "inverse": lambda o: o.MM.inv(),
    "inverse of an inverse": lambda o: (o.MM + o.D).inv().inv(),
    "power -1": lambda o: o.D**-1,
    "power 2": lambda o: o.tau**2,
    "power 3": lambda o: o.E_psi**3,
    "power -2": lambda o: o.phi**-2,
    "identity added": lambda o: o.I + o.H @ o.phi @ o.K,
    "identity subtracted": lambda o: 2 * o.I - o.phi,
    "identity in a product": lambda o: o.H @ o.I @ o.phi @ (3 * o.I),
    "identity inverted": lambda o: (2 * o.I).inv() @ o.M,
    "identity transposed": lambda o: o.I.T + o.phi.T,
    "sums of products": lambda o: (o.M + o.P) @ (o.phi.T - o.psi.T) @ o.H.T,
    "transpose of an inverse": lambda o: (o.I + o.phi @ o.K @ o.H).inv().T,
    "inverse of a transpose": lambda o: (o.I + o.phi @ o.K @ o.H).T.inv(),
    "diagonal blocks": lambda o: (o.phi @ o.M @ o.phi.T).blockdiag(),
    "diagonal blocks between spaces": lambda o: (o.H @ o.phi).blockdiag(),
    "square root": lambda o: o.M.sqrt() @ o.M.sqrt().T,
    "square root in an inverse": lambda o: o.D.sqrt().inv() @ o.H,
}


@pytest.mark.parametrize("name", FORMULAS)
def test_arithmetic(name, letters):
    check(FORMULAS[name](letters))


def test_sum_of_a_list_and_zero(letters):
    check(Formula(sum([letters.M.op, letters.P.op, letters.R.op]), *parts(letters.M + letters.P + letters.R)))
    soa, M = letters.soa, letters.M
    assert (0 + M.op) == M.op == (M.op + 0) == (M.op - 0) and (0 - M.op) == -M.op
    zero = pc.zero(soa.V, soa.F)
    assert not zero.dense().any() and zero.shape == M.op.shape and (zero.T.domain, zero.T.codomain) == (soa.V, soa.F)
    check(Formula(M.op + zero, *parts(M)))
    assert not (letters.H.op @ zero @ np.ones(len(soa.V))).any()
    assert not (M.op - M.op).dense().any()


def parts(formula):
    return formula.value, formula.error


def test_numpy_on_either_side(letters):
    MM = letters.MM
    n = len(MM.value)
    rng = np.random.default_rng(1)
    x, X = rng.uniform(-1, 1, n), rng.uniform(-1, 1, (4, n))
    MM.assert_close(x @ MM.op, x @ MM.value, np.sqrt(n))
    MM.assert_close(X @ MM.op, X @ MM.value, np.sqrt(4 * n))
    G = letters.G
    y = rng.uniform(-1, 1, len(G.value))
    G.assert_close(y @ G.op, y @ G.value, np.sqrt(len(y)))
    arrays = np.array(2), np.array(2.0), np.array(np.longdouble(2)), np.ma.array(2.0)
    for number in (np.float64(2), np.float32(2), np.int64(2), *arrays, 2, True + True):
        assert number * MM.op == 2 * MM.op == MM.op * number
        assert float(number * MM.op.trace()) == float(MM.op.trace() * number) == 2 * float(MM.op.trace())
    arrays = np.array(1j), np.array([2.0]), np.array([]), np.array("2")
    for none in (np.complex128(1j), np.complex64(2), np.ma.masked, *arrays, "2", np.datetime64(1, "s"), None):
        for refused in (lambda x: MM.op.trace() * x, lambda x: x * MM.op.trace(), lambda x: MM.op * x):
            with pytest.raises(TypeError):
                refused(none)
    assert np.float64(0) + MM.op == MM.op
    MM.assert_close(MM.op @ list(x), MM.value @ x, np.sqrt(n))
    whole = np.arange(n)
    MM.assert_close(MM.op @ whole, MM.value @ whole, n * np.sqrt(n))
    for array in (np.asfortranarray(X.T), X.T, np.repeat(X.T, 2, axis=1)[:, ::2]):
        MM.assert_close(MM.op @ array, MM.value @ array, np.sqrt(4 * n))
    assert (MM.op @ np.zeros((n, 0))).shape == (n, 0)


def test_what_a_product_does_not_do_to_its_arguments(letters):
    x = np.arange(1.0, len(letters.soa.Theta) + 1)
    kept = x.copy()
    y = letters.MM.op @ x
    z = letters.MM.op @ x
    assert np.array_equal(x, kept) and np.array_equal(y, z) and not np.shares_memory(y, z)
    same = letters.soa.I @ x
    same[0] = 99.0
    assert x[0] == 1.0


# ---------------------------------------------------------------------- identity and zero


def test_identity_has_no_space_until_it_is_combined(letters):
    I, soa = pc.identity(), letters.soa
    assert I == soa.I and I.domain is None and I.codomain is None and (I + letters.MM.op).domain == soa.Theta
    x = np.arange(6.0)
    assert np.array_equal(I @ x, x) and np.array_equal((2 * I) @ x, 2 * x) and np.array_equal(I.T @ x, x)
    assert np.array_equal(I @ np.outer(x, x), np.outer(x, x))
    for ask in (
        lambda: I.dense(),
        lambda: np.asarray(I),
        lambda: I.diagonal(),
        lambda: I.shape,
        lambda: float(I.trace()),
        lambda: float(I.logdet()),
        lambda: float(I.norm()),
        lambda: (I + I).dense(),
    ):
        with pytest.raises(pc.SpaceError, match="no space"):
            ask()
    spaced = pc.identity(soa.F)
    assert np.array_equal(spaced.dense(), np.eye(len(soa.F))) and spaced != I
    assert float(spaced.logdet()) == 0 and float(spaced.trace()) == len(soa.F)
    with pytest.raises(pc.SpaceError, match="I cannot be added to H, which maps F .* to Θ"):
        I + letters.H.op
    with pytest.raises(pc.SpaceError):
        letters.M.op + I  # V → F is no map of a space to itself


# ---------------------------------------------------------------------- constants


def test_constants_of_every_form(letters):
    soa, rng = letters.soa, np.random.default_rng(2)
    n, nf = len(soa.Theta), len(soa.F)
    sizes = [s.stop - s.start for _, s, _ in soa.F.blocks]
    made = {
        "full": letters.constant(rng.normal(size=(n, n)), soa.Theta, soa.Theta),
        "diagonal": letters.constant(rng.uniform(1, 2, n), soa.Theta, soa.Theta),
        "blocks": letters.constant([rng.normal(size=(s, s)) for s in sizes], soa.F, soa.F),
        "between spaces": letters.constant(rng.normal(size=(n, nf)), soa.F, soa.Theta),
        "border": letters.constant(rng.normal(size=(n, 2)), 2, soa.Theta),
        "own space": letters.constant(rng.normal(size=(3, n)), soa.Theta, pc.euclidean(3)),
    }
    for formula in made.values():
        check(formula)
    check(letters.MM + made["full"])
    check(made["full"] @ letters.MM @ made["diagonal"])
    check(letters.phi @ made["blocks"] @ letters.phi)
    check(made["between spaces"] @ letters.K)
    check((letters.MM + made["border"] @ made["border"].T).inv())
    check(made["own space"] @ letters.MM.inv() @ made["own space"].T)
    tree = letters.constant(reference.block_diagonal([np.full((s, s), 2.0) for s in sizes]), soa.F, soa.F)
    assert tree.op.is_block_diagonal and made["diagonal"].op.is_block_diagonal and not made["full"].op.is_block_diagonal
    assert not made["full"].op.is_symmetric and made["diagonal"].op.is_symmetric


def test_a_constant_keeps_its_numbers():
    soa = pc.chain(2).soa
    array = np.eye(2)
    C = pc.constant(array, soa.Theta, soa.Theta)
    array[:] = 7
    assert np.array_equal(C.dense(), np.eye(2))
    D = pc.constant(np.eye(2), soa.Theta, soa.Theta)
    assert C == C and hash(C) == hash(C.T.T.children[0].children[0]) and C != D  # told apart by identity, not by numbers


# ---------------------------------------------------------------------- vectors


def test_named_vectors(letters):
    soa, rng = letters.soa, np.random.default_rng(3)
    n = len(soa.Theta)
    T, U = pc.vector("T", soa.Theta), pc.vector("U", soa.Theta)
    t, u = rng.uniform(-1, 1, n), rng.uniform(-1, 1, n)
    MM = letters.MM
    product = MM.op @ T
    assert product.kind == "product" and product.shape == (n, 1)
    MM.assert_close(product.value(T=t), MM.value @ t, np.sqrt(n))
    MM.assert_close((MM.op @ (T - 2 * U)).value(T=t, U=u), MM.value @ (t - 2 * u), 3 * np.sqrt(n))
    MM.assert_close((T.T @ MM.op @ U).value(T=t, U=u), [t @ MM.value @ u], n)
    MM.assert_close((T @ (U.T @ MM.op @ T)).value(T=t, U=u), t * (u @ MM.value @ t), n)
    outer = Formula(MM.op + T @ U.T, MM.value + np.outer(t, u), MM.error)
    assert np.array_equal(T.value(T=t), t)
    with pytest.raises(pc.EvaluationError, match="the vector 'T' has no value: give it by name"):
        outer.op.dense()
    with pytest.raises(pc.EvaluationError, match="the vector 'T' has 2 entries; it lies in Θ"):
        product.value(T=t[:2])
    with pytest.raises(pc.SpaceError, match="is an operator, not a vector"):
        MM.op.value()
    with pytest.raises(pc.SpaceError, match=r"T maps R\^1 to Θ .* cannot follow U"):
        T @ U


# ---------------------------------------------------------------------- states


def test_state_binding(model):
    Q, V = uniform_batch(model, 2, 3)
    H, phi, M, Vt = model.soa("H phi M V_tilde")
    MM = H @ phi @ M @ phi.T @ H.T
    here = MM.dense()
    there = MM.at(Q[0])
    letters_of(model, Q[0], V[0]).MM.assert_close(there.dense())
    assert np.array_equal(MM.dense(), here)  # binding leaves the expression as it was
    assert np.array_equal(there.at(Q[1]).dense(), there.dense())  # the innermost binding wins
    mixed = (there + MM).at(Q[1])
    assert np.array_equal(mixed.dense(), (MM.at(Q[0]) + MM.at(Q[1])).dense())
    assert np.array_equal(there.inv().dense(), MM.inv().at(Q[0]).dense())
    state = model.random_state(3)
    assert np.array_equal(MM.at(state).dense(), there.dense())
    assert not Vt.at(Q[0]).dense().any()  # v = 0 where it is left out
    assert np.array_equal(Vt.at(state).dense(), Vt.at(Q[0], V[0]).dense())
    assert np.array_equal(Vt.at(Q, V[0]).dense()[1], Vt.at(Q[1], V[0]).dense())
    present = MM.at()
    copy = every_kind(rotor_inertia=True)
    H2, phi2, M2 = copy.soa("H phi M")
    MM2 = H2 @ phi2 @ M2 @ phi2.T @ H2.T
    frozen = MM2.at()
    copy.q = Q[1]
    assert np.array_equal(MM2.dense(), MM.at(Q[1]).dense()) and np.array_equal(frozen.dense(), present.dense())


def test_batches_must_agree(model):
    Q, V = uniform_batch(model, 3, 3)
    H, M = model.soa("H M")
    with pytest.raises(pc.EvaluationError, match="batches of 2 and 3 states in one expression"):
        (M.at(Q[:2]) + M.at(Q)).dense()
    with pytest.raises(pc.EvaluationError, match="two precisions in one expression"):
        (M.at(Q[0]) + M.at(Q[0], precision="quad")).dense()
    n = model.nv
    for wrong in (np.ones((2, n)), np.ones((n, 2)), np.ones((3, n, 2, 1))):
        with pytest.raises(pc.EvaluationError, match=r"it takes an array of shape \(\d+,\), \(3, \d+\) or \(3, \d+, m\), not "):
            H.T.at(Q) @ wrong


def test_state_and_parameters_are_seen_at_the_next_evaluation():
    model = every_kind()
    H, phi, M, J = model.soa("H phi M J")
    MM = H @ phi @ M @ phi.T @ H.T
    x = np.ones(model.nv)
    solve = (MM + J).inv()
    changes = [
        lambda: setattr(model, "q", model.random_state(9).q),
        lambda: setattr(model.bodies["body3"], "mass", 9.0),
        lambda: setattr(model.bodies["body4"], "com", (0.3, 0.1, 0.2)),
        lambda: setattr(model.bodies["body5"], "inertia", 2 * np.eye(3)),
        lambda: setattr(model.hinges["hinge4"], "placement", np.eye(4)),
        lambda: setattr(model.hinges["hinge4"], "rotor_inertia", [0.5, 0.7]),
    ]
    for change in changes:
        before = MM.dense(), solve @ x
        change()
        letters = letters_of(model)
        total = letters.MM + letters.J
        letters.MM.assert_close(MM.dense())
        total.inv().assert_close(solve @ x, np.linalg.solve(total.value, x), np.sqrt(len(x)))
        total.assert_close(model.mass_matrix(model.q))
        assert not np.array_equal(before[1], solve @ x)


# ---------------------------------------------------------------------- scalars, diagonals, norms


def test_scalars_are_expressions(letters):
    MM, D = letters.MM, letters.D
    for formula in (
        MM,
        D,
        MM.inv(),
        letters.I + letters.H @ letters.phi @ letters.K,
        letters.phi @ letters.psi,
        letters.Upsilon @ letters.M,
    ):
        formula.assert_close(formula.op.diagonal(), np.diag(formula.value))
        formula.assert_close(float(formula.op.trace()), np.trace(formula.value), len(formula.value))
        formula.assert_close(float(formula.op.norm()), norm(formula.value), np.sqrt(formula.value.size))
    for formula in (MM, D, MM.inv(), letters.I + letters.H @ letters.phi @ letters.K, letters.phi @ letters.psi):
        formula.assert_logdet()
    letters.H.assert_close(float(letters.H.op.norm()), norm(letters.H.value), np.sqrt(letters.H.value.size))
    trace, logdet = MM.op.trace(), MM.op.logdet()
    t, d = float(trace), float(logdet)
    for scalar, number in [
        (trace + logdet, t + d),
        (trace - logdet, t - d),
        (2 * trace, 2 * t),
        (trace * 2, 2 * t),
        (trace / 4, t / 4),
        (-trace, -t),
        (1 + trace, 1 + t),
        (trace + 1, t + 1),
        (1 - trace, 1 - t),
        (trace - 1, t - 1),
        (0.5 * (trace - 2 * logdet) + 3, 0.5 * (t - 2 * d) + 3),
    ]:
        assert isinstance(scalar, pc.Scalar) and abs(float(scalar) - number) <= 4 * EPS * (abs(t) + abs(d) + 4)
    assert f"{trace:.3f}" == f"{t:.3f}" and np.asarray(trace).shape == () and float(np.asarray(trace)) == t
    assert trace == MM.op.trace() and hash(trace) == hash(MM.op.trace()) and trace != logdet


def test_norms_of_long_operators():
    """Above 600 columns as the root of a trace over the tree: between dual spaces and into nodes too."""
    soa = pc.chain(101).soa
    for operator in (soa.phi, soa.M @ soa.phi.T, soa.H @ soa.phi, soa.B(["body100"]).T @ soa.phi.T):
        assert float(operator.norm()) == pytest.approx(np.linalg.norm(operator.dense()), rel=1e-12), operator.text()


def test_scalars_of_a_batch(model):
    Q, _ = uniform_batch(model, 3, 4)
    H, phi, M = model.soa("H phi M")
    MM = H @ phi @ M @ phi.T @ H.T
    whole = np.asarray((2 * MM.logdet() + MM.trace()).at(Q))
    expected = [float((2 * MM.logdet() + MM.trace()).at(q)) for q in Q]
    assert np.array_equal(whole, expected)
    with pytest.raises(TypeError, match="batch"):
        float(MM.trace().at(Q))


def test_a_scalar_times_a_scalar_keeps_no_snapshot():
    """A scalar is an expression: its product with another must follow the state, or be refused."""
    arm = pc.chain(2)
    D, R = arm.soa("D R")
    trace = D.trace() * 1.0
    try:
        square = trace * (R.trace() / 1.0)
    except TypeError:
        return
    arm.q = [0.3, 1.2]
    assert abs(float(square) - float(D.trace()) * float(R.trace())) <= 1e-12


# ---------------------------------------------------------------------- adjoints


@pytest.mark.parametrize("name", [*LETTERS, "Delta_theta_dot", "V_tilde", "V_bar", "momentum_cross", "H_dot", "X_world"])
def test_adjoints_of_letters(name, model):
    adjoint(getattr(model.soa, name))


def test_adjoints_of_node_operators(model):
    names = nodes_of(model)
    for op in (model.soa.B(names), model.soa.Jacobian(names), model.soa.Lambda(["node9", "node10"]), model.soa.Delta(2)):
        adjoint(op)


@pytest.mark.parametrize("seed", range(12))
def test_adjoints_of_random_expressions(seed, letters):
    rng = np.random.default_rng(seed)
    domain, codomain = (str(s) for s in rng.choice(list("TVF"), 2))
    adjoint(draw(seeded(rng), letters, domain, codomain, 3).op)


def adjoint(op):
    """⟨Ax, y⟩ = ⟨x, A*y⟩ to 10⁵ roundings: a few sweeps each way, and the growth of what cancels inside A."""
    rng = np.random.default_rng(len(op.domain))
    scale = float(op.norm()) + norm(np.abs(op.dense()))
    for _ in range(3):
        x, y = rng.uniform(-1, 1, len(op.domain)), rng.uniform(-1, 1, len(op.codomain))
        assert abs((op @ x) @ y - x @ (op.T @ y)) <= 1e5 * EPS * scale * norm(x) * norm(y)
    assert op.T.domain == op.codomain.dual and op.T.codomain == op.domain.dual
    assert np.abs(op.T.dense() - op.dense().T).max(initial=0.0) <= 1e5 * EPS * scale
