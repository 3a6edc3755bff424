"""The forms of the articulated-inertia sweep: `fast`, `ud` and `square-root` are one recursion, spelled so that rounding differs.

Everything that derives from P is compared with the reference, for every kind of hinge, on branches, with and without rotors, and on
bare trees of blocks of any size: in double with the dense oracle, in wider precisions with the same oracle in mpmath numbers. Bounds
are the running bounds of `formulas`, in the epsilon of the precision: roundings of one sweep, amplified by what cancels in P. The
forms that carry factors cancel less; they are held to the same bound here, and to sharper ones in test_refinement.
"""

import pickle

import mpmath
import numpy as np
import pytest

import pycraft as pc
from pycraft import _core
from support.block_trees import TREES, letters_on, random_blocks
from support.descriptions import KINDS, body, model, random_description, subhinge
from support.forms import FORMS, RICCATI, epsilon, largest
from support.formulas import EPS, SLACK, Letters, amplification, letters_of, norm
from support.mechanisms import SEQUENCES, SHAPES, build, every_kind, massless_inner_bodies, rotors_on_some, uniform_batch, with_hinges
from support.oracle import reference

DIGITS = 60
each_form = pytest.mark.parametrize("form", FORMS)
each_hinge = pytest.mark.parametrize("kind", [*KINDS, *SEQUENCES])
rotors = pytest.mark.parametrize("rotor_inertia", [False, True], ids=["no rotors", "rotors"])


# ---------------------------------------------------------------------- mechanisms


SPECIAL = {
    "massless inner bodies": massless_inner_bodies,
    "rotors on some": rotors_on_some,
    "one pin": lambda: random_description([-1], ["pin"], 3),
    "one free body": lambda: random_description([-1], ["free"], 4),
    "one free body with rotors": lambda: random_description([-1], ["free"], 4, rotor_inertia=True),
    "one body without coordinates": lambda: random_description([-1], ["weld"], 5),
    "nothing but welds": lambda: random_description([-1, 0, 0], ["weld"] * 3, 5),
    "welds between": lambda: random_description([-1, 0, 1, 2, 1], ["weld", "ball", "weld", "pin", "weld"], 6),
    "eight coordinates with rotors": lambda: random_description([-1, 0], [("slider", "free", "pin"), "pin"], 7, rotor_inertia=True),
}
each_special = pytest.mark.parametrize("name", SPECIAL)


def oracle_of(multibody):
    """The dense oracle of a model at its present state."""
    return reference.operators(multibody.description(), multibody.q, multibody.v)


def in_digits(multibody):
    """The same oracle in mpmath numbers; within mpmath.workdps(DIGITS)."""
    return reference.operators(multibody.description(), multibody.q * mpmath.mpf(1), multibody.v)


def assert_forms(soa, o, exact, form, precision, q=None):
    """Quantities derived from P, in one form and precision, against the oracle `exact`: within the bound from `o` in that epsilon."""
    letters, scale = Letters(soa, o), epsilon(precision) / EPS
    made = {name: getattr(letters, name) for name in RICCATI}
    made["mass_matrix_inverse"] = (letters.MM + letters.J).inv() if o.J.any() else letters.MM.inv()
    for name, formula in made.items():
        got = formula.op.at(q, form=form, precision=precision).dense(dtype=object if scale < 1 else float)
        off = largest(got - getattr(exact, name))
        assert off <= formula.bound * scale, f"{name} in {form}: off by {off:.2e}, bound {formula.bound * scale:.2e}"


# ---------------------------------------------------------------------- operators


@rotors
@pytest.mark.parametrize("shape", ["tree", *(pytest.param(shape, marks=pytest.mark.slow) for shape in SHAPES if shape != "tree")])
@each_hinge
def test_operators_in_double(kind, shape, rotor_inertia):
    multibody = with_hinges(kind, shape, rotor_inertia)
    o = oracle_of(multibody)
    for form in FORMS:
        assert_forms(multibody.soa, o, o, form, "double", multibody.q)


@each_special
def test_operators_of_special_models(name):
    multibody = build_quietly(SPECIAL[name]())
    o = oracle_of(multibody)
    with mpmath.workdps(DIGITS):
        exact = in_digits(multibody)
        for form in FORMS:
            for precision in ("double", "extended", "quad") if multibody.nq else ("double",):  # q brings the reference its digits
                assert_forms(multibody.soa, o, exact, form, precision, multibody.q)


def build_quietly(description):
    """The model at a random state; what is worth a warning (massless bodies) is meant."""
    multibody = pc.Multibody.from_description(description)
    multibody.take_warnings()
    state = multibody.random_state(2)
    multibody.q, multibody.v = state.q, state.v
    return multibody


@pytest.mark.parametrize("kind", [kind if kind in ("universal", "free") else pytest.param(kind, marks=pytest.mark.slow)
                                  for kind in [*KINDS, *SEQUENCES]])  # fmt: skip
def test_operators_in_wider_precisions(kind):
    """Against mpmath: a quad is right to some 1e-33 times what the tree amplifies, in every form."""
    multibody = with_hinges(kind, "tree", rotor_inertia=len(kind) % 2 == 0)
    o = oracle_of(multibody)
    with mpmath.workdps(DIGITS):
        exact = in_digits(multibody)
        for form in FORMS:
            for precision in ("extended", "quad"):
                assert_forms(multibody.soa, o, exact, form, precision, multibody.q)


@rotors
def test_forms_agree_in_quad(rotor_inertia):
    """A tree of every kind: 1e-32 times what it amplifies, 1e-28 in the end."""
    multibody = every_kind(rotor_inertia)
    letters = letters_of(multibody)
    with mpmath.workdps(DIGITS):
        for name in RICCATI:
            made = [getattr(multibody.soa, name).at(multibody.q, form=form, precision="quad").dense(dtype=object) for form in FORMS]
            size, bound = largest(made[0]), 2 * getattr(letters, name).bound * epsilon("quad") / EPS
            assert bound <= 1e-26 * (1 + size)
            for other in made[1:]:
                assert largest(other - made[0]) <= min(bound, 1e-28 * (1 + size) * amplification(letters.o))


@each_form
@rotors
def test_reductions_and_nodes(rotor_inertia, form):
    multibody = every_kind(rotor_inertia)
    letters = letters_of(multibody)
    total = letters.MM + letters.J
    for precision in ("double", "quad"):
        at = dict(form=form, precision=precision)
        for formula in (letters.D, total):
            moved = SLACK * norm(np.linalg.inv(formula.value)) * formula.error * len(formula.value) + len(formula.value) * EPS
            expected = np.linalg.slogdet(total.value)[1]
            assert abs(float(formula.op.logdet().at(multibody.q, **at)) - expected) <= moved
        total.inv().assert_close(total.inv().op.at(multibody.q, **at).diagonal(), np.diag(total.inv().value))
        nodes = ["node9", "node10"]
        letters.Lambda(nodes).assert_close(multibody.soa.Lambda(nodes).at(multibody.q, **at).dense())


# ---------------------------------------------------------------------- bare trees


@each_form
@pytest.mark.parametrize("with_J", [False, True], ids=["J = 0", "J"])
@pytest.mark.parametrize("shape", TREES)
def test_bare_trees(shape, with_J, form):
    """Blocks of 3, 6 and 9 states, any number of coordinates, none included."""
    for seed in range(2):
        letters = letters_on(shape, with_J, seed)
        assert_forms(letters.soa, letters.o, letters.o, form, "double")


@pytest.mark.parametrize("with_J", [False, True], ids=["J = 0", "J"])
@pytest.mark.parametrize("shape", ["tree", "one"])
def test_bare_trees_in_quad(shape, with_J):
    blocks = random_blocks(TREES[shape], np.random.default_rng([8, with_J]), with_J, sizes=(2, 3, 5))
    o = reference.sko_operators(*blocks)
    soa = pc.sko_model(*blocks)
    with mpmath.workdps(DIGITS):
        wide = [None if x is None else [None if b is None else np.asarray(b) * mpmath.mpf(1) for b in x] for x in blocks[1:]]
        exact = reference.sko_operators(blocks[0], *wide)
        for form in FORMS:
            assert_forms(soa, o, exact, form, "quad")


@each_form
def test_semidefinite_blocks(form):
    """Inertias without full rank, zero among them, and J on some coordinates of a hinge, on bare blocks."""
    rng = np.random.default_rng(9)
    thin = lambda s, r: (lambda X: X @ X.T)(np.round(rng.normal(size=(s, r)) * 16) / 16)
    parents, sizes, dof = [-1, 0, 1, 1, 0], [6, 4, 5, 3, 6], [2, 1, 2, 3, 1]
    E = [None, *[rng.normal(size=(sizes[p], s)) / np.sqrt(s) for p, s in zip(parents[1:], sizes[1:], strict=True)]]
    H = [rng.normal(size=(n, s)) for n, s in zip(dof, sizes, strict=True)]
    M = [np.zeros((6, 6)), thin(4, 2), thin(5, 5), thin(3, 3), thin(6, 3)]
    J = [np.diag([0.5, 0.0]), np.zeros((1, 1)), np.diag([0.0, 0.7]), np.zeros((3, 3)), np.zeros((1, 1))]
    blocks = parents, E, H, M, J
    o = reference.sko_operators(*blocks)
    assert_forms(pc.sko_model(*blocks), o, o, form, "double")


@pytest.mark.parametrize("form", ["ud", "square-root"])
def test_indefinite_blocks_are_no_wrong_numbers(form):
    """`fast` takes any symmetric M that leaves D regular; a form that needs factors of M raises if there are none."""
    rng = np.random.default_rng(0)
    E, H = [None, rng.normal(size=(3, 3))], [rng.normal(size=(n, 3)) for n in (1, 2)]
    blocks = [-1, 0], E, H, [np.diag([2, -0.5, 1]), np.diag([1, 2, -0.3])]
    o = reference.sko_operators(*blocks)
    soa = pc.sko_model(*blocks)
    Letters(soa, o).D.assert_close(soa.D.dense())
    with pytest.raises(pc.Error, match="(?i)definite"):
        pytest.fail(f"D is {soa.D.at(form=form).dense()}, and not {o.D}")


# ---------------------------------------------------------------------- dynamics


def test_forward_dynamics():
    """Gravity, velocities and forces; results are rounded to doubles."""
    for multibody in (every_kind(), every_kind(True), *[build_quietly(f()) for f in SPECIAL.values()]):
        description, o = multibody.description(), oracle_of(multibody)
        tau = np.random.default_rng(3).normal(size=multibody.nv)
        expected = reference.forward_dynamics(description, multibody.q, multibody.v, tau)
        forces = norm(o.H @ o.phi) * (norm(o.M @ o.a) + norm(o.b)) * (1 + norm(o.phi)) + norm(tau)
        bound = SLACK * Letters(multibody.soa, o)._grown * norm(o.mass_matrix_inverse) * forces
        for form in FORMS:
            for precision in ("double", "extended", "quad"):
                got = multibody.forward_dynamics(multibody.q, multibody.v, tau, form=form, precision=precision)
                off = np.abs(got - expected).max(initial=0.0)
                assert off <= bound + norm(expected) * 4 * EPS, f"{multibody.name} in {form}, {precision}: off by {off:.2e}"


@each_form
@pytest.mark.parametrize("name", ["massless inner bodies", "rotors on some", "one free body with rotors"])
def test_forward_dynamics_against_mpmath(name, form):
    """In quad the rounding to a double is all that is left."""
    multibody = build_quietly(SPECIAL[name]())
    tau = np.random.default_rng(4).normal(size=multibody.nv)
    with mpmath.workdps(DIGITS):
        exact = reference.forward_dynamics(multibody.description(), multibody.q * mpmath.mpf(1), multibody.v, tau)
        got = multibody.forward_dynamics(multibody.q, multibody.v, tau, form=form, precision="quad")
        assert all(abs(x - y) <= EPS / 2 * abs(y) * (1 + 1e-9) for x, y in zip(got, exact, strict=True))


@each_form
def test_batches(form):
    multibody = every_kind(True)
    Q, V = uniform_batch(multibody, 5, 5)
    tau = np.random.default_rng(0).normal(size=(5, multibody.nv))
    for refine in (0, 1):
        whole = multibody.forward_dynamics(Q, V, tau, form=form, refine=refine)
        single = [multibody.forward_dynamics(q, v, t, form=form, refine=refine) for q, v, t in zip(Q, V, tau, strict=True)]
        bound = 1e3 * EPS * amplification(letters_of(multibody).o)
        for i in range(5):  # packs of states may round in another order than one state does
            assert np.abs(whole[i] - single[i]).max() <= bound * (1 + np.abs(single[i]).max())
    H, phi, M, J, P, K, Upsilon = multibody.soa("H phi M J P K Upsilon")
    for op in (P, K, Upsilon, (H @ phi @ M @ phi.T @ H.T + J).inv()):
        whole = op.at(Q, form=form).dense()
        for i, q in enumerate(Q):
            letters = letters_of(multibody, q)
            formula = letters.formula(op, op.at(q, form=form).dense(), "P")
            formula.assert_close(whole[i])
            assert np.array_equal(whole[i], formula.value)


# ---------------------------------------------------------------------- derivatives, pickles, names


@rotors
def test_derivatives(rotor_inertia):
    """By rule from the values of each form, against complex steps of the oracle: both exact to rounding, amplified twice."""
    multibody = with_hinges("universal", "tree", rotor_inertia)
    description, q, soa = multibody.description(), np.array(multibody.q), multibody.soa
    H, phi, M, J = soa("H phi M J")
    total = H @ phi @ M @ phi.T @ H.T + J
    made = {name: getattr(soa, name) for name in ("P", "D", "G", "K", "psi", "Upsilon", "Omega")}
    made["mass_matrix_inverse"] = total.inv()
    o = letters_of(multibody).o
    bound = 48 * 5 * EPS * norm(o.phi) * amplification(o) ** 2 * SLACK
    for i in range(0, multibody.nv, 2):
        moved = reference.operators(description, q + 1e-30j * np.eye(len(q))[i])
        expected = {name: np.imag(getattr(moved, name)) / 1e-30 for name in made}
        of_logdet = np.trace(np.linalg.solve(o.mass_matrix + o.J, np.imag(moved.mass_matrix) / 1e-30))
        for form in FORMS:
            for name, op in made.items():
                got = op.at(q, form=form).diff(i).dense()
                size = norm(expected[name]) + norm(getattr(o, name)) * norm(o.phi)
                off = np.abs(got - expected[name]).max()
                assert off <= bound * size, f"∂{name} in {form}: off by {off:.2e}, bound {bound * size:.2e}"
                assert np.array_equal(op.diff(i).at(q, form=form).dense(), got)
            off = abs(float(total.logdet().diff(i).at(q, form=form)) - of_logdet)
            assert off <= bound * (1 + abs(of_logdet)) * np.linalg.cond(o.mass_matrix + o.J)


def heavy_tip(ratio=1e9, n=6):
    """A chain on which the forms round apart."""
    rng = np.random.default_rng(1)
    made = [body(f"b{k}", k - 1, [subhinge("pin", np.eye(3)[k % 3])], 1.0 if k < n - 1 else ratio, [0.1, 0.05, 0.5],
                 np.diag([0.2, 0.18, 0.08]) * (1.0 if k < n - 1 else ratio), [0.2, 0.1, 1.0]) for k in range(n)]  # fmt: skip
    multibody = build(model(made, (0, 0, -9.81)), 3)
    return multibody, rng.normal(size=n)


WAYS = {
    "form": [dict(form="fast"), dict(form="ud"), dict(form="square-root")],
    "refine": [dict(refine=0), dict(refine=1)],
    "precision": [dict(precision="double"), dict(precision="extended")],
    "all": [dict(), dict(form="ud", refine=2, residual="wider", precision="single")],
}


@pytest.mark.parametrize("which", WAYS)
def test_pickles_keep_the_way_to_compute(which):
    """A bound expression and its copy give the same bits, and not those of another way."""
    multibody, x = heavy_tip()
    H, phi, M, K = multibody.soa("H phi M K")
    op = (H @ phi @ M @ phi.T @ H.T).inv()
    values = []
    for way in WAYS[which]:
        bound = op.at(multibody.q, **way)
        again = pickle.loads(pickle.dumps(bound))
        values.append(bound @ x)
        assert np.array_equal(again @ x, values[-1]) and str(again) == str(bound)
        scalar = op.logdet().at(multibody.q, **{k: w for k, w in way.items()})
        assert float(pickle.loads(pickle.dumps(scalar))) == float(scalar)
        assert np.array_equal(pickle.loads(pickle.dumps(K.at(multibody.q, **way))).dense(), K.at(multibody.q, **way).dense())
    assert all(not np.array_equal(values[0], other) for other in values[1:])


def test_the_innermost_binding_wins():
    multibody, x = heavy_tip()
    K = multibody.soa.K
    ud = K.at(multibody.q, form="ud")
    assert np.array_equal((ud @ multibody.soa.D).at(multibody.q, form="fast").dense(), (ud @ multibody.soa.D.at(multibody.q)).dense())
    assert not np.array_equal(ud.dense(), K.at(multibody.q).dense())


THERE_ARE = {
    "form": ("cholesky", FORMS),
    "precision": ("double-double", ("single", "double", "extended", "quad", "50", "100")),
    "residual": ("narrower", ("same", "gather", "wider")),
    "refine": ("sometimes", ("auto",)),
    "method": ("magic", ("articulated", "cholesky", "ldl", "conjugate-gradients", "inverse", "divide-and-conquer", "realization")),
    "on_singular": ("ignore", ("raise", "minimum-norm")),
}


@pytest.mark.parametrize("option", THERE_ARE)
def test_unknown_names_are_refused_with_a_list(option):
    """Everywhere the option is taken: a ValueError of this package's own, with the name asked for and all there are."""
    multibody, x = heavy_tip()
    wrong, names = THERE_ARE[option]
    zero = np.zeros(multibody.nv)
    calls = {"forward dynamics": lambda: multibody.forward_dynamics(multibody.q, zero, x, **{option: wrong})}
    if option != "method":
        calls["mass matrix inverse"] = lambda: multibody.mass_matrix_inverse(multibody.q, **{option: wrong})
    if option not in ("method", "on_singular"):
        calls["expression"] = lambda: multibody.soa.D.at(multibody.q, **{option: wrong})
        calls["scalar"] = lambda: multibody.soa.D.logdet().at(multibody.q, **{option: wrong})
        calls["refinement"] = lambda: multibody.refinement(multibody.q, zero, x, **{option: wrong})
    for what, call in calls.items():
        with pytest.raises(pc.Error) as error:
            pytest.fail(f"{what} took it: {call()}")
        assert isinstance(error.value, ValueError), f"{what}: {type(error.value)}"
        assert wrong in str(error.value) and all(name in str(error.value) for name in names), f"{what}: {error.value}"


def test_there_are_these_forms_and_precisions():
    assert list(_core.forms()) == list(FORMS)
    assert [str(name) for name in _core.precisions()] == ["single", "double", "extended", "quad", "50", "100"]
    eps = [epsilon(name) for name in _core.precisions()]
    assert eps == sorted(eps, reverse=True) and eps[1] == EPS and eps[-1] < 1e-99
    assert str(_core.wider("double")) == "extended" and _core.wider(_core.precisions()[-1]) is None


def test_the_reference_agrees_with_itself():
    """The forms of the oracle, `joseph` among them, are one in 60 digits, with rotors, massless bodies and blocks of any size."""
    names = ["P", "P_plus", "D", "D_inverse", "G"]
    with mpmath.workdps(DIGITS):
        for description in (massless_inner_bodies(), rotors_on_some(), random_description([-1, 0, 0], ["custom", "free", "ball"], 3)):
            multibody = build_quietly(description)
            first, *others = (
                reference.operators(multibody.description(), multibody.q * mpmath.mpf(1), multibody.v, form) for form in reference.FORMS
            )
            for o in others:
                for name in names:
                    off = largest(getattr(o, name) - getattr(first, name))
                    assert off <= 1e-52 * (1 + largest(getattr(first, name))), f"{o.form}: {name} off by {off:.1e}"
    letters = letters_on("tree", True, 1)
    blocks_of = random_blocks(TREES["tree"], np.random.default_rng([1, list(TREES).index("tree")]), True)
    for form in reference.FORMS:
        o = reference.sko_operators(*blocks_of, form=form)
        for name in RICCATI:
            getattr(letters, name).assert_close(getattr(o, name))
    with pytest.raises(ValueError, match="fast, joseph, ud, square-root"):
        pytest.fail(str(reference.sko_operators(*blocks_of, form="triangular").P))
