"""Every operator of the tables against the dense oracle, for every hinge kind, tree shape, rotor inertia and precision.

Tolerances are the running bounds of `formulas`: roundings of one sweep times the size of what it makes, times the amplification
of the Riccati sweep where P is in play.
"""

import numpy as np
import pytest

import pycraft as pc
from support.descriptions import KINDS, random_description
from support.formulas import EPS, LETTERS, SLACK, letters_of, norm
from support.mechanisms import LARGE_TREE, SEQUENCES, SHAPES, build, every_kind, nodes_of, uniform_batch, with_hinges
from support.oracle import reference

MOVING = "Delta_theta_dot V_tilde V_bar momentum_cross H_dot".split()
VECTORS = {"theta_dot": "v", "velocity": "V", "a": "a", "b": "b", "gravity_base": "a_gravity"}
rotors = pytest.mark.parametrize("rotor_inertia", [False, True], ids=["no rotors", "rotors"])
each_hinge = pytest.mark.parametrize("kind", [*KINDS, *SEQUENCES])
each_shape = pytest.mark.parametrize("shape", SHAPES)


def expected_vector(o, name):
    """The oracle's vector; its `a` includes gravity at the roots, the operators' does not."""
    return o.a - o.a_gravity if name == "a" else getattr(o, VECTORS[name])


# ---------------------------------------------------------------------- letters


@rotors
@each_shape
@each_hinge
def test_letters_are_the_oracles(kind, shape, rotor_inertia):
    model = with_hinges(kind, shape, rotor_inertia)
    letters, rng = letters_of(model), np.random.default_rng(1)
    for name in [*LETTERS, *MOVING]:
        letter = getattr(letters, name)
        letter.assert_close(letter.op.dense())
        letter.assert_applies(rng)
    for i in range(model.nv):
        letters.Delta(i).assert_close(letters.soa.Delta(i).dense())
    o = letters.o
    for name in VECTORS:
        vector = letters.formula(getattr(letters.soa, name), expected_vector(o, name)[:, None], name)
        # a and b are products of velocities that may cancel: they are rounded at the size of ‖V‖² and ‖V‖ ‖MV‖
        vector.error += 48 * len(o.parents) * EPS * norm(o.V) * (norm(o.V) + norm(o.v) + norm(o.M @ o.V))
        vector.assert_close(vector.op.value(), vector.value[:, 0])
        vector.assert_close(vector.op.dense())


@rotors
@each_hinge
def test_node_operators_are_the_oracles(kind, rotor_inertia):
    model = with_hinges(kind, "tree", rotor_inertia, seed=3)
    letters, rng = letters_of(model), np.random.default_rng(2)
    names = nodes_of(model)
    for chosen in ([names[0]], names[::-1], [names[-1], "body1", names[-1]]):
        for name in ("B", "Jacobian"):
            letter = getattr(letters, name)(chosen)
            letter.assert_close(letter.op.dense())
            letter.assert_applies(rng)
    assert np.array_equal(letters.soa.B(names[0]).dense(), letters.soa.B([names[0]]).dense())


def test_operational_space_inertia_is_the_oracles():
    for rotor_inertia in (False, True):
        model = every_kind(rotor_inertia)
        letters = letters_of(model)
        B, Omega = letters.B(["node9", "node10"]), letters.Omega
        for spelled in ((B.T @ Omega @ B).inv(), (B.T * Omega * B).inv()):
            spelled.assert_applies(np.random.default_rng(0))
            spelled.assert_close(letters.soa.Lambda(["node9", "node10"]).dense())
            spelled.assert_close(letters.Lambda(["node9", "node10"]).value)


def test_singular_operational_space_inertia_is_an_error():
    arm = pc.chain(3)
    arm.add_node("tip", "body2", position=(1, 0, 0))
    with pytest.raises(pc.SingularOperatorError):
        arm.soa.Lambda("tip") @ np.ones(6)  # three coordinates cannot give six motions


@rotors
def test_x_world_carries_forces_to_the_world(rotor_inertia):
    model = every_kind(rotor_inertia)
    o = letters_of(model).o
    blocks = [reference.force_transform(o.world_pose(k)) for k in range(len(o.parents))]
    X = model.soa.X_world.dense()
    assert np.abs(X - reference.block_diagonal(blocks)).max() <= 48 * 5 * EPS * norm(X)
    field = np.concatenate([[0, 0, 0, *o.world_pose(k)[:3, :3].T @ model.gravity] for k in range(len(o.parents))])
    assert np.abs(model.soa.gravity_field.value() - field).max() <= 48 * 5 * EPS * norm(model.gravity)


@rotors
@pytest.mark.parametrize("precision", ["extended", "quad"])
def test_wider_precisions_agree_to_double_rounding(precision, rotor_inertia):
    model = every_kind(rotor_inertia)
    letters, rng = letters_of(model), np.random.default_rng(3)
    for name in [*LETTERS, *MOVING]:
        letter = getattr(letters, name)
        wide = letter.op.at(model.q, model.v, precision=precision)
        letter.assert_close(wide.dense())
        x = rng.uniform(-1, 1, letter.value.shape[1])
        letter.assert_close(wide @ x, letter.value @ x, np.sqrt(len(x)))
    for name in ("B", "Jacobian"):
        letter = getattr(letters, name)(nodes_of(model))
        letter.assert_close(letter.op.at(model.q, precision=precision).dense())
    letters.MM.inv().assert_close(letters.MM.inv().op.at(model.q, precision=precision).dense())


def test_wide_results_as_objects_keep_their_digits():
    import mpmath

    model = every_kind()
    H, phi, M = model.soa("H phi M")
    MM = H @ phi @ M @ phi.T @ H.T
    error = {}
    with mpmath.workprec(200):
        best = MM.at(model.q, precision="quad").dense(dtype=object)
        assert best.dtype == object and isinstance(best[0, 0], mpmath.mpf)
        for precision, epsilon in (("double", EPS), ("extended", 2.0**-63), ("quad", 2.0**-112)):
            wide = MM.at(model.q, precision=precision)
            residual = wide.dense(dtype=object) @ wide.inv().dense(dtype=object) - np.eye(model.nv)
            error[precision] = float(max(abs(x) for x in residual.flat)) / epsilon
    # ℳℳ⁻¹ - I is a few roundings times the condition number, of each precision's own epsilon: about the same multiple of each
    condition = np.linalg.cond(MM.dense())
    assert all(x <= SLACK * model.nv * condition for x in error.values()), error
    assert error["quad"] * 2.0**-112 < 1e-3 * error["extended"] * 2.0**-63


# ---------------------------------------------------------------------- models of the generators


@rotors
@pytest.mark.parametrize("kind", KINDS)
def test_generated_trees_are_the_oracles(kind, rotor_inertia):
    model = pc.tree([-1, 0, 1, 0, 3], [kind, "pin", kind, "slider", kind], seed=7, rotor_inertia=rotor_inertia, welds="keep")
    state = model.random_state(1)
    model.q, model.v = state.q, state.v
    letters = letters_of(model)
    for name in [*LETTERS, *MOVING]:
        letter = getattr(letters, name)
        letter.assert_close(letter.op.dense())


def test_uniform_chain_in_closed_form():
    """Rods stretched along x with pins along z: the mass matrix of a chain of n, ∫ of distances to both hinges."""
    n = 5
    arm = pc.chain(n)
    H, phi, M = arm.soa("H phi M")
    # rod k covers [k, k+1]: ℳ_ij = Σ_{k >= max(i,j)} ∫_k^{k+1} (x - i)(x - j) dx
    cubic = lambda x, i, j: x**3 / 3 - (i + j) * x**2 / 2 + i * j * x
    expected = [[sum(cubic(k + 1, i, j) - cubic(k, i, j) for k in range(max(i, j), n)) for j in range(n)] for i in range(n)]
    dense = (H @ phi @ M @ phi.T @ H.T).dense()
    assert np.abs(dense - expected).max() <= 48 * n * EPS * norm(expected)


def test_lumped_and_kept_welds_have_the_same_mass_matrix():
    parents, kinds = [-1, 0, 1, 2, 1, 4, 5], ["pin", "weld", "ball", "weld", "weld", "weld", "universal"]
    for seed in range(3):
        lumped, kept = (pc.tree(parents, kinds, seed=seed, rotor_inertia=True, welds=w) for w in ("lump", "keep"))
        q = lumped.random_state(seed).q
        assert set(lumped.nodes) >= {"body1", "body3", "body4", "body5"} and len(kept.bodies) == 7
        expected = kept.mass_matrix(q)
        assert np.abs(lumped.mass_matrix(q) - expected).max() <= 48 * 7 * EPS * norm(expected)
        for frame in ("body1", "body3", "body5"):
            assert np.abs(lumped.jacobian(frame, q) - kept.jacobian(frame, q)).max() <= 48 * 7 * EPS * norm(kept.jacobian(frame, q))


# ---------------------------------------------------------------------- batches


@pytest.mark.parametrize("precision", ["double", "extended"])
def test_batches_of_states(precision):
    model = every_kind(rotor_inertia=True)
    Q, V = uniform_batch(model, 3, 5)
    rng = np.random.default_rng(6)
    all_letters = [letters_of(model, q, v) for q, v in zip(Q, V, strict=True)]
    for name in [*LETTERS, *MOVING]:
        bound_op = getattr(model.soa, name).at(Q, V, precision=precision)
        dense = bound_op.dense()
        rows, n = dense.shape[1:]
        x, X, XX, y = (
            rng.uniform(-1, 1, n),
            rng.uniform(-1, 1, (3, n)),
            rng.uniform(-1, 1, (3, n, 2)),
            rng.uniform(-1, 1, (3, rows)),
        )
        shared, each, wide, transposed = bound_op @ x, bound_op @ X, bound_op @ XX, bound_op.T @ y
        assert bound_op.batch == 3 and wide.shape == (3, rows, 2)
        for i, letters in enumerate(all_letters):
            letter = getattr(letters, name)
            letter.assert_close(dense[i])
            letter.assert_close(shared[i], letter.value @ x, np.sqrt(n))
            letter.assert_close(each[i], letter.value @ X[i], np.sqrt(n))
            letter.assert_close(wide[i], letter.value @ XX[i], np.sqrt(2 * n))
            letter.assert_close(transposed[i], letter.value.T @ y[i], np.sqrt(rows))


def test_a_batch_of_states_gives_the_bits_of_its_states():
    model = build(random_description(LARGE_TREE, KINDS, 77), 1)
    Q, _ = uniform_batch(model, 5, 9)
    H, phi, M, D, Upsilon = model.soa("H phi M D Upsilon")
    MM = H @ phi @ M @ phi.T @ H.T
    for op in (MM, MM.inv(), D, Upsilon, phi):
        whole = op.at(Q).dense()
        assert all(np.array_equal(whole[i], op.at(q).dense()) for i, q in enumerate(Q))
    assert np.array_equal(np.asarray(MM.logdet().at(Q)), [float(MM.logdet().at(q)) for q in Q])
    assert np.array_equal(MM.at(Q).diagonal(), [MM.at(q).diagonal() for q in Q])


def test_a_batch_of_none():
    model = every_kind()
    none = np.zeros((0, model.nq))
    H, phi, M = model.soa("H phi M")
    MM = (H @ phi @ M @ phi.T @ H.T).at(none)
    n = model.nv
    assert MM.dense().shape == (0, n, n) and MM.inv().dense().shape == (0, n, n) and MM.batch == 0
    assert (MM @ np.zeros(n)).shape == (0, n) and (MM @ np.zeros((0, n, 2))).shape == (0, n, 2)
    assert MM.diagonal().shape == (0, n)
    for scalar in (MM.trace(), MM.logdet(), MM.norm()):
        assert np.asarray(scalar).shape == (0,)
