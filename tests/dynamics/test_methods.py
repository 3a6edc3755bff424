"""Forward dynamics by the methods beside the articulated-body algorithm, against that in quad precision.

What divide and conquer has to itself is in test_divide_and_conquer.py.

Tolerances. A backward stable solution of ℳx = b, b = T - 𝒞, is exact for some ℳ + δℳ, b + δb, so its error is at most
‖ℳ⁻¹‖ (‖δb‖ + ‖δℳ‖ ‖x‖). What is rounded in 𝒞 and in composite inertias is `roundings` of the sizes summed (`force_size`), and a
factorization or a product adds at most n roundings of ‖ℳ‖. The explicit inverse is not backward stable: ‖ℳ⁻¹‖ ‖b‖ stands for ‖x‖, and
the Riccati sweep amplifies.
"""

import numpy as np
import pytest

import pycraft as pc
from pycraft import _core
from support.descriptions import KINDS
from support.formulas import EPS, amplification, norm
from support.mechanisms import SEQUENCES, every_kind, random_tree, uniform_batch, with_hinges
from support.oracle import reference
from support.singular_hinges import REGULAR, SINGULAR, at_random_state
from support.sizes_of_calls import force_size, roundings

METHODS = _core.methods()
each_method = pytest.mark.parametrize("method", METHODS)
FACTORS = ["cholesky", "ldl"]
PRECISIONS = {"extended": np.finfo(np.longdouble).eps, "quad": 2.0**-112}


def solve(model, method, q, v, tau, precision="double", out=None):
    return _core.Methods(model).forward_dynamics(method, q, v, tau, precision, out)


def bound(model, method, q, v, tau, x):
    """Return the possible effect of rounding on the accelerations x, in the norm."""
    o = reference.operators(model.description(), q, v)
    mass_matrix = o.mass_matrix + o.J
    inverse = norm(np.linalg.inv(mass_matrix))
    size, right_side = force_size(o, model.description(), x) + norm(tau), norm(mass_matrix @ x)
    eps = roundings(o) + 10 * model.nv * EPS
    if method == "inverse":
        return inverse * eps * (size + norm(mass_matrix) * inverse * right_side) * amplification(o)
    return inverse * eps * (size + norm(mass_matrix) * norm(x))


def check(model, q, v, tau, methods=METHODS):
    expected = model.forward_dynamics(q, v, tau, precision="quad")
    for method in methods:
        error = norm(solve(model, method, q, v, tau) - expected)
        allowed = bound(model, method, q, v, tau, expected)
        assert error <= allowed, f"{method}: off by {error:.2e}, bound {allowed:.2e}"


@pytest.mark.parametrize("rotor_inertia", [False, True], ids=["no rotors", "rotors"])
@pytest.mark.parametrize("shape", ["chain", "tree", "forest"])
@pytest.mark.parametrize("kind", [*KINDS, *SEQUENCES])
def test_every_method_is_the_articulated_body_algorithm(kind, shape, rotor_inertia):
    model = with_hinges(kind, shape, rotor_inertia, seed=5)
    check(model, model.q, model.v, np.random.default_rng(1).uniform(-3, 3, model.nv))


@pytest.mark.parametrize("seed", range(6))
def test_random_trees(seed):
    rng = np.random.default_rng(seed)
    model = random_tree(rng, int(rng.integers(1, 25)))
    check(model, model.q, model.v, rng.uniform(-3, 3, model.nv))


def test_one_body():
    for kind in ("pin", "free", "ball", "planar"):
        model = pc.Multibody("one")
        model.add_body("b", hinge=kind, mass=2.0, com=(0.3, 0.2, 0.1), inertia=np.diag([1.0, 1.2, 1.4]))
        model.gravity = (0, 0, -9.81)
        check(model, model.zero_q(), np.ones(model.nv), np.ones(model.nv))


@each_method
def test_no_coordinates_at_all(method):
    model = pc.Multibody("welded", welds="keep")
    model.add_body("a", hinge="weld", mass=1.0)
    model.add_body("b", "a", hinge="weld", mass=1.0)
    assert solve(model, method, [], [], []).shape == (0,)
    empty = pc.Multibody("nothing")
    assert solve(empty, method, [], [], []).shape == (0,)


@each_method
def test_batches_are_their_states(method):
    model = every_kind(rotor_inertia=True)
    Q, V = uniform_batch(model, 3)
    T = np.random.default_rng(2).uniform(-1, 1, V.shape)
    out = np.empty_like(V)
    whole = solve(model, method, Q, V, T, out=out)
    assert whole is out
    for i in range(3):
        assert np.array_equal(whole[i], solve(model, method, Q[i], V[i], T[i]))
    shared = solve(model, method, Q, V[0], T[0])
    assert np.array_equal(shared[2], solve(model, method, Q[2], V[0], T[0]))
    assert solve(model, method, Q[:0], V[:0], T[:0]).shape == (0, model.nv)


@each_method
@pytest.mark.parametrize("precision", PRECISIONS)
def test_wider_precisions(method, precision):
    """Accelerations rounded to double: half an epsilon of each is all that is left."""
    model = every_kind(rotor_inertia=True)
    tau = np.random.default_rng(3).uniform(-1, 1, model.nv)
    expected = model.forward_dynamics(model.q, model.v, tau, precision="quad")
    inside = bound(model, method, model.q, model.v, tau, expected) * PRECISIONS[precision] / EPS
    error = np.abs(solve(model, method, model.q, model.v, tau, precision) - expected)
    assert (error <= EPS * np.abs(expected) + inside).all()


@each_method
def test_parameters_may_change(method):
    model = pc.chain(3, seed=2)
    before = solve(model, method, model.q, model.v, np.ones(3))
    model.bodies["body2"].mass = 5.0
    after = solve(model, method, model.q, model.v, np.ones(3))
    assert not np.allclose(before, after)
    check(model, model.q, model.v, np.ones(3), [method])


def test_conjugate_gradients_tell_what_they_did():
    """At most n iterations in exact arithmetic; a few more by rounding, a few times over for the true residual."""
    model = pc.tree([-1, 0, 0, 1, 1, 2, 4], ["pin", "ball", "slider", "pin", "universal", "pin", "free"], seed=3)
    Q, V = uniform_batch(model, 4)
    T = np.random.default_rng(0).uniform(-1, 1, V.shape)
    solution, iterations, residual = _core.Methods(model).conjugate_gradients(Q, V, T, "double")
    assert np.array_equal(solution, solve(model, "conjugate-gradients", Q, V, T))
    assert iterations.shape == residual.shape == (4,)
    assert (iterations >= 1).all() and (iterations <= 10 * model.nv).all()
    assert (residual < np.sqrt(EPS)).all()
    # the residual is what it is called, in the norm of the diagonal
    for i in range(4):
        matrix, b = model.mass_matrix(Q[i]), T[i] - model.bias_forces(Q[i], V[i])
        weights = 1 / np.sqrt(np.diag(matrix))
        true = norm(weights * (b - matrix @ solution[i])) / norm(weights * b)
        rounding = 100 * model.nv * EPS * norm(weights[:, None] * matrix * weights) * norm(solution[i] / weights) / norm(weights * b)
        assert abs(true - residual[i]) <= rounding
    at_rest = _core.Methods(model).conjugate_gradients(Q[0], V[0] * 0, model.bias_forces(Q[0], V[0] * 0), "double")
    assert at_rest[1] == 0 and not at_rest[0].any()


def test_conjugate_gradients_on_an_ill_conditioned_chain():
    """cond ℳ ≈ 4·256⁴ = 1.7e10: refused in double with the numbers and the remedy. Half as long it is solved."""
    model = pc.chain(256)
    q, tau = np.zeros(256), np.random.default_rng(1).uniform(-1, 1, 256)
    with pytest.raises(
        pc.SingularOperatorError, match=r"'conjugate-gradients' does not converge .*256 coordinates \(relative residual .* iterations"
    ):
        solve(model, "conjugate-gradients", q, q, tau)
    with pytest.raises(pc.SingularOperatorError, match='method="articulated" with form="ud"'):
        solve(model, "conjugate-gradients", q, q, tau)
    check(pc.chain(128), q[:128], q[:128], tau[:128])


@pytest.mark.parametrize("method", FACTORS)
@pytest.mark.parametrize("name", SINGULAR)
def test_factors_refuse_what_is_singular(name, method):
    model = at_random_state(SINGULAR[name][0]())
    for seed in range(20):
        q = model.random_state(seed).q
        with pytest.raises(
            pc.SingularOperatorError, match=f"method '{method}': the mass matrix is not positive definite to rounding at coordinate"
        ):
            pytest.fail(f"gave {solve(model, method, q, np.zeros(model.nv), np.ones(model.nv))}")


def test_the_coordinate_at_fault_is_named():
    model = pc.Multibody("tip")
    model.add_body("a", mass=1.0, com=(1, 0, 0))
    model.add_body("b", "a", mass=0.0, position=(1, 0, 0))
    model.take_warnings()
    for method in (*FACTORS, "conjugate-gradients"):
        with pytest.raises(ArithmeticError, match=r"coordinate 'b' \(pivot 0, rounding bound 0\): give the bodies it moves a mass"):
            solve(model, method, [0, 0], [0, 0], [1, 1])
    with pytest.raises(pc.SingularHingeError, match="hinge 'b'"):
        solve(model, "inverse", [0, 0], [0, 0], [1, 1])


@pytest.mark.parametrize("method", FACTORS)
@pytest.mark.parametrize("name", REGULAR)
def test_what_is_only_extreme_is_solved_in_quad(name, method):
    model = at_random_state(REGULAR[name]())
    tau = np.random.default_rng(4).uniform(-1, 1, model.nv)
    expected = model.forward_dynamics(model.q, model.v, tau, precision="quad")
    assert norm(solve(model, method, model.q, model.v, tau, "quad") - expected) <= 1e-12 * norm(expected)


BATCH, SHORT = np.zeros((3, 2)), np.zeros((2, 2))


@pytest.mark.parametrize("method", ["realization", "cholesky"])
@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (dict(q=[0.0]), r"q of 'chain of 2 rods' takes 2 numbers, or \(B, 2\) for a batch"),
        (dict(v=[0.0] * 3), "v of 'chain of 2 rods' takes 2 numbers"),
        (dict(tau=[0.0] * 3), "tau of 'chain of 2 rods' takes 2 numbers"),
        (dict(tau="x"), "tau is not an array of numbers"),
        (dict(tau=[1j, 0]), "tau is complex; models take real numbers"),
        (dict(q=BATCH, v=SHORT), "batches of 3 and 2 states in one call"),
        (dict(q=BATCH, tau=SHORT), "batches of 3 and 2 states in one call"),
        (dict(q=[0, np.nan]), "q of hinge 'hinge1': entry 0 is nan"),
        (dict(tau=[0, np.nan]), "tau of hinge 'hinge1': entry 0 is nan"),
        (dict(out=np.zeros(2, np.float32)), r"out= takes a writeable C-ordered float64 array of shape \(2\)"),
        (dict(out=np.zeros(3)), r"out= takes .* of shape \(2\)"),
        (dict(q=BATCH, out=np.zeros((2, 3)).T), r"out= takes .* of shape \(3, 2\)"),
    ],
)
def test_the_realization_checks_its_arguments_as_the_others_do(method, arguments, words):
    with pytest.raises(pc.ModelError, match=words):
        pc.chain(2).forward_dynamics(**{"q": [0, 0], "v": [0, 0], "tau": [0, 0], "method": method, **arguments})


def test_the_realization_of_a_batch():
    model = pc.chain(3)
    q = np.random.default_rng(0).uniform(-1, 1, (2, 3))
    out = np.empty((2, 3))
    assert model.forward_dynamics(q, np.zeros(3), np.ones(3), method="realization", out=out) is out
    assert np.allclose(out, model.forward_dynamics(q, np.zeros(3), np.ones(3)))
    assert model.forward_dynamics(q[:0], np.zeros(3), np.ones(3), method="realization").shape == (0, 3)
    tip = pc.Multibody("tip")
    tip.add_body("a", mass=1.0, com=(1, 0, 0))
    tip.add_body("b", "a", mass=0.0, position=(1, 0, 0))
    tip.take_warnings()
    with pytest.raises(pc.Error, match=r"\(state 0 of a batch of 2\)"):
        tip.forward_dynamics(np.zeros((2, 2)), [0, 0], [1, 1], method="realization")
    empty = pc.Multibody("nothing")
    assert empty.forward_dynamics([], [], [], method="realization").shape == (0,)
    assert empty.forward_dynamics(np.zeros((4, 0)), [], [], method="realization").shape == (4, 0)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (dict(refine=True), "refine=True: a number of corrections"),
        (dict(refine=10**12), "refine=1000000000000: a number of corrections, 0, 1, 2, ..., 1000, or 'auto'"),
        (dict(refine=-1), "refine=-1"),
        (dict(refine=1.0), "refine=1.0"),
        (dict(refine=1, residual="wider", precision=100), "nothing is wider than 100 digits"),
        (dict(method=3), "method=3: give a name"),
    ],
)
def test_options_that_make_no_sense(options, words):
    model = pc.chain(2)
    with pytest.raises(pc.EvaluationError, match=words):
        model.forward_dynamics([0, 0], [0, 0], [1, 1], **options)
    if "method" not in options:
        with pytest.raises(pc.EvaluationError, match=words):
            model.mass_matrix_inverse([0, 0], **options)
        with pytest.raises(pc.EvaluationError, match=words):
            model.refinement([0, 0], [0, 0], [1, 1], **options)


def test_counts_of_numpy_are_numbers():
    model = pc.chain(2)
    expected = model.forward_dynamics([0.1, 0.2], [0, 0], [1, 1], refine=2)
    assert np.array_equal(model.forward_dynamics([0.1, 0.2], [0, 0], [1, 1], refine=np.int64(2)), expected)


def test_memory():
    """Of conjugate gradients as many numbers as coordinates; of divide and conquer 2N - 1 nodes of a chain; of the others N² of them."""
    model, long = pc.chain(10), pc.chain(20)
    for method in METHODS:
        sizes = [_core.Methods(model).memory(method, precision) for precision in ("double", "extended", "quad")]
        assert 10 * 100 < sizes[0] < sizes[1] and abs(sizes[2] / sizes[0] - 2) < 0.05
        growth = _core.Methods(long).memory(method, "double") / sizes[0]
        if method in ("conjugate-gradients", "divide-and-conquer"):
            assert growth == pytest.approx(2, abs=1e-9 if method == "conjugate-gradients" else 1 / 19)
        else:
            assert growth > 2.1


def test_errors():
    model = pc.chain(2)
    with pytest.raises(
        pc.EvaluationError, match="no method of forward dynamics is called 'lu'; there are 'articulated', 'cholesky', 'ldl'"
    ):
        solve(model, "lu", [0, 0], [0, 0], [0, 0])
    with pytest.raises(pc.ModelError, match="tau of .* takes 2 numbers"):
        solve(model, "ldl", [0, 0], [0, 0], [0])
    with pytest.raises(pc.ModelError, match="v of hinge '.*': entry 0 is nan"):
        solve(model, "ldl", [0, 0], [np.nan, 0], [0, 0])
