"""Requests for ℳ⁻¹, Ω and Λ as a whole (ln det, trace, diagonal, blocks) use the Riccati sweep, in every form."""

import mpmath
import numpy as np
import pytest

import pycraft as pc
from campaigns import refusals
from support.mechanisms import every_kind

EPS = np.finfo(float).eps
FORMS = ("fast", "ud", "square-root")


def letters(model):
    return model.soa("H phi M J D psi K Omega I")


def mass_matrix(model):
    H, phi, M, *_ = letters(model)
    return H @ phi @ M @ phi.T @ H.T


@pytest.fixture(scope="module", params=[False, True], ids=["no rotors", "rotors"])
def tree(request):
    model = every_kind()
    model.take_warnings()
    if request.param:
        for hinge in model.hinges.values():
            hinge.rotor_inertia = np.linspace(0.1, 0.3, hinge.v_slice.stop - hinge.v_slice.start)
    names = list(model.bodies)
    model.add_node("tool", names[-1], position=(0.3, -0.2, 0.5))
    model.q = model.random_state(seed=3).q
    return model


def heavy_tip(ratio, n=10):
    """Rods with a heavy one at the end, pins askew."""
    rng = np.random.default_rng(0)
    model = pc.Multibody("heavy tip")
    for k in range(n):
        mass = ratio if k == n - 1 else 1.0
        model.add_body(
            f"rod{k}",
            f"rod{k - 1}" if k else None,
            axis=rng.normal(size=3),
            position=(1, 0, 0) if k else (0, 0, 0),
            mass=mass,
            com=(0.5, 0, 0),
            inertia=mass * np.diag([0.02, 0.09, 0.1]),
        )
    model.add_node("tool", f"rod{n - 1}", position=(1, 0.2, 0))
    model.q = model.random_state(seed=0).q
    return model


def tiers(op, request):
    plan = op.plan(request)
    return {step["tier"] for step in plan.steps}, plan


def test_no_elimination_is_planned(tree):
    H, phi, M, J, D, psi, K, Omega, I = letters(tree)
    MM = H @ phi @ M @ phi.T @ H.T
    moved = MM + J
    S = I - H @ psi @ K
    B = tree.soa.B("tool")
    typed = phi.T @ H.T @ moved.inv() @ H @ phi
    C = pc.constant(np.eye(tree.nv), tree.soa.Theta, tree.soa.Theta)
    asked = [(moved, "logdet"), (moved.inv(), "logdet"), (2 * moved, "logdet"), (C @ moved, "logdet")]
    asked += [
        (op, r)
        for op in (moved.inv(), S.T @ D.inv() @ S, Omega, typed, C @ moved.inv())
        for r in ("trace", "diagonal", "blockdiag")
        if op is not typed
    ]
    asked += [(typed, "blockdiag"), (M @ Omega, "trace"), (M @ Omega @ M, "diagonal")]
    asked += [(op, r) for op in (tree.soa.Lambda("tool"), (B.T @ typed @ B).inv()) for r in ("apply", "dense", "logdet", "trace")]
    for op, request in asked:
        used, plan = tiers(op, request)
        assert used <= {"values", "kernel", "sweep"}, (request, plan)


@pytest.mark.parametrize("form", FORMS)
def test_values_are_those_of_the_dense_matrices(tree, form):
    MM, J, Omega = mass_matrix(tree), tree.soa.J, tree.soa.Omega
    q = tree.q
    moved = (MM + J).at(q, form=form)
    A = np.asarray((MM + J).at(q, precision="quad").dense())
    Y = np.linalg.inv(A)
    bound = 1000 * tree.nv * EPS * np.linalg.cond(A)
    assert abs(float(moved.logdet()) - np.linalg.slogdet(A)[1]) <= bound
    assert np.abs(moved.inv().diagonal() - np.diag(Y)).max() <= bound * np.abs(Y).max()
    assert abs(float(moved.inv().trace()) - np.trace(Y)) <= bound * np.abs(Y).max()
    blocks = np.asarray(pc.blockdiag(moved.inv()).dense())
    for hinge in tree.hinges.values():
        at = hinge.v_slice
        assert np.abs(blocks[at, at] - Y[at, at]).max(initial=0) <= bound * np.abs(Y).max()
    W = np.asarray(Omega.at(q, form=form).dense())
    assert np.abs(np.diag(W) - Omega.at(q, form=form).diagonal()).max() <= bound * np.abs(W).max()


@pytest.mark.parametrize("ratio", [1e3, 1e9])
def test_each_form_keeps_its_digits(ratio):
    """ud does not feel the ratio; fast does; refinement, one precision up, does not either."""
    arm = heavy_tip(ratio)
    MM = mass_matrix(arm)
    scalars = {
        "logdet": lambda e: np.array(float(e.logdet())),
        "trace": lambda e: np.array(float(e.inv().trace())),
        "diagonal": lambda e: e.inv().diagonal(),
    }
    for name, ask in scalars.items():
        exact = ask(MM.at(arm.q, precision=50))
        off = {rung: np.max(np.abs(ask(MM.at(arm.q, **rung_arguments)) / exact - 1)) for rung, rung_arguments in RUNGS.items()}
        assert off["ud"] <= 1000 * EPS and off["fast, refine=1"] <= max(1e-3 * off["fast"], 10 * EPS), (name, off)
        assert off["ud, refine=1"] <= 2 * EPS, (name, off)


RUNGS = {
    "fast": {"form": "fast"},
    "ud": {"form": "ud"},
    "fast, refine=1": {"form": "fast", "refine": 1},
    "ud, refine=1": {"form": "ud", "refine": 1},
}


@pytest.mark.parametrize("offset", [1.0, 1e2, 1e4, 1e6])
def test_the_operational_space_inertia_keeps_half_the_condition(offset):
    """Λ = (X*X)⁻¹ with X = D^-½HψB: its error grows with the condition number of X, the root of Λ's."""
    for seed in range(3):
        rng = np.random.default_rng(seed)
        model = pc.Multibody("long offsets")
        for k in range(8):
            model.add_body(
                f"body{k}",
                f"body{k - 1}" if k else None,
                axis=rng.normal(size=3),
                position=offset * rng.normal(size=3) if k else (0, 0, 0),
                mass=1,
                com=0.1 * rng.normal(size=3),
                inertia=0.1 * np.eye(3),
            )
        model.add_node("tool", "body7", position=(0.1, 0.2, 0.3))
        q = model.random_state(seed=seed).q
        exact = np.asarray(model.soa.Lambda("tool").at(q, precision=50).dense())
        unit = np.sqrt(np.diag(exact))
        condition = np.linalg.cond(exact / np.outer(unit, unit))
        for form in FORMS:
            Lambda = np.asarray(model.soa.Lambda("tool").at(q, form=form).dense())
            off = np.abs((Lambda - exact) / np.outer(unit, unit)).max()
            assert off <= 100 * EPS * np.sqrt(condition), (seed, form, off, condition)
        Omega = np.linalg.inv(exact / np.outer(unit, unit))
        assert (
            abs(float(model.soa.Lambda("tool").at(q, form="ud").logdet()) + np.linalg.slogdet(Omega)[1] - 2 * np.log(unit).sum())
            <= 1e-9 * condition**0.5
        )


def test_a_short_rank_is_refused():
    arm = pc.chain(8)  # planar: no rotation about x or y, no travel along z
    arm.add_node("tip", "body7", position=(1, 0, 0))
    arm.q = np.linspace(0.1, 0.8, 8)
    for ask in (lambda Lambda: Lambda.dense(), lambda Lambda: float(Lambda.logdet())):
        with pytest.raises(pc.SingularOperatorError, match="8 coordinates do not move"):
            ask(arm.soa.Lambda("tip"))


def test_it_answers_where_the_solve_does():
    """Graded random arms: what forward dynamics solves, ln det, trace and diagonal do not refuse, and have its digits."""
    refused = 0
    for seed in range(40):
        rng = np.random.default_rng(seed)
        model = pc.Multibody("graded")
        for k in range(int(rng.integers(3, 12))):
            mass, length = 10.0 ** rng.uniform(-6, 6), 10.0 ** rng.uniform(-2, 2)
            model.add_body(
                f"body{k}",
                f"body{int(rng.integers(0, k))}" if k else None,
                axis=rng.normal(size=3),
                position=length * rng.normal(size=3),
                mass=mass,
                com=length * 0.3 * rng.normal(size=3),
                inertia=mass * length**2 * np.diag([0.1, 0.2, 0.25]),
            )
        q = model.random_state(seed=seed).q
        MM = mass_matrix(model)
        try:
            MM.inv().at(q, form="ud") @ np.ones(model.nv)
        except pc.Error:
            refused += 1
            continue
        exact = MM.at(q, precision=50)
        A = MM.at(q, form="ud")
        assert abs(float(A.logdet()) - float(exact.logdet())) <= 1000 * EPS * max(1.0, abs(float(exact.logdet())))
        assert np.max(np.abs(A.inv().diagonal() / exact.inv().diagonal() - 1)) <= 1e-11, seed
        assert abs(float(A.inv().trace() / float(exact.inv().trace())) - 1) <= 1e-11
    assert refused <= 4


def test_determinants_in_many_digits():
    """Independent: the dense matrix of 50 digits and mpmath's determinant."""
    arm = heavy_tip(1e9, 5)
    MM = mass_matrix(arm).at(arm.q, precision=50)
    with mpmath.workdps(60):
        exact = mpmath.log(mpmath.det(mpmath.matrix(np.asarray(MM.dense(dtype=object)).tolist())))
    assert abs(float(MM.logdet()) - float(exact)) <= 4 * EPS * abs(float(exact))


@pytest.mark.parametrize("seeds", [range(6), pytest.param(range(100, 200), marks=pytest.mark.slow)], ids=["a part", "a hundred models"])
def test_the_whole_refuses_where_a_product_does(seeds):
    """See `campaigns.refusals`."""
    counts, wrong = refusals.run(seeds)
    assert counts["models"] == len(seeds) and not wrong, wrong
