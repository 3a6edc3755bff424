"""Typed derivatives of (ℳ + J)⁻¹ keep the digits of the factored forms: they run by the derivative of the Riccati sweep."""

import numpy as np
import pytest

import pycraft as pc
from support.forms import FACTORED, FORMS, KINDS, PARENTS, heavy_tip

STEP = "the derivative of the Riccati sweep"


def inverse(model):
    """(ℳ + J)⁻¹ as it is typed."""
    return (model.soa.MM + model.soa.J).inv()


def steps_of(expression):
    """The plan as it is explained, whatever the width of its lines."""
    return " ".join(str(expression.explain()).split())


def relative(got, truth, scale=0.0):
    return np.abs(got - truth).max() / max(np.abs(truth).max(), scale)


def heavy(seed):
    model, q, v, tau = heavy_tip(seed)
    model.add_node("tool", list(model.bodies)[3], position=(0.3, 0.1, 0.2))  # at the tip all of it would cancel
    model.q, model.v = q, v
    return model, q, v, tau


# ---------------------------------------------------------------------- light links before a tip of 1e9 times their mass


@pytest.mark.parametrize("form", FACTORED)
@pytest.mark.parametrize("seed", range(2))
def test_a_product_keeps_the_digits_of_the_direct_call(seed, form):
    model, q, _, x = heavy(seed)
    ways = dict(precision="quad"), dict(form=form)
    typed, direct = ([inverse(model).diff(i).at(q, **how) @ x for i in range(model.nv)] for how in ways)
    size = np.abs(typed).max()
    assert max(relative(g, t, 1e-3 * size) for g, t in zip(direct, typed, strict=True)) < 1e-11
    swept = model.forward_dynamics_derivatives(q, 0 * x, x, form=form).q
    assert relative(np.array(direct).T, swept) < 1e-12


def requests(model, q, v, x):
    """Everything that is asked of ∂(ℳ⁻¹), by name, as calls of the keywords of `at`."""
    i, MM, soa = 6, model.soa.MM, model.soa
    along = model.hinges[list(model.hinges)[5]]
    body = model.bodies[list(model.bodies)[5]]
    S = soa.I - soa.H @ soa.psi @ soa.K
    tool = soa.Jacobian("tool")
    made = {
        "dense": lambda **how: MM.inv().diff(i).at(q, **how).dense(),
        "several columns": lambda **how: MM.inv().diff(i).at(q, **how) @ np.column_stack([x, x[::-1], 0 * x]),
        "diagonal": lambda **how: MM.inv().diff(i).at(q, **how).diagonal(),
        "blocks": lambda **how: pc.blockdiag(MM.inv().diff(i)).at(q, **how).dense(),
        "trace": lambda **how: np.array(float(MM.inv().diff(i).at(q, **how).trace())),
        "a batch": lambda **how: MM.inv().diff(i).at(np.array([q, q + 0.1]), **how) @ x,
        "MM + J": lambda **how: (MM + soa.J).inv().diff(i).at(q, **how) @ x,
        "by R": lambda **how: (soa.H @ (soa.R + soa.phi_tilde @ soa.R + soa.R @ soa.phi_tilde.T) @ soa.H.T).inv().diff(i).at(q, **how) @ x,
        "a multiple": lambda **how: (3 * MM).inv().diff(i).at(q, **how) @ x,
        "with D beside": lambda **how: (soa.D @ MM.inv()).diff(i).at(q, **how) @ x,
        "at a node": lambda **how: (tool @ MM.inv().diff(i) @ tool.T).at(q, **how).dense(),
        "bound before": lambda **how: MM.inv().at(q, **how).diff(i) @ x,
        "time": lambda **how: MM.inv().dot().at(q, v, **how) @ x,
        "ln det": lambda **how: np.array(float(MM.at(q, **how).logdet().diff(i))),
        "mass": lambda **how: MM.inv().diff(body.symbol("mass")).at(q, **how) @ x,
        "com": lambda **how: MM.inv().diff(body.symbol("com", "x")).at(q, **how) @ x,
        "inertia": lambda **how: MM.inv().diff(body.symbol("inertia", "x", "y")).at(q, **how) @ x,
        "rotor": lambda **how: (MM + soa.J).inv().diff(along.symbol("rotor_inertia", 0)).at(q, **how) @ x,
        "placement": lambda **how: MM.inv().diff(along.symbol("placement", "ry")).at(q, **how) @ x,
        "axis": lambda **how: MM.inv().diff(along.symbol("axis", "x")).at(q, **how) @ x,
        "point": lambda **how: MM.inv().diff(along.symbol("point", "x")).at(q, **how) @ x,
    }
    return made | {"factors": lambda **how: (S.T @ soa.D.inv() @ S).at(q, **how) @ x}


NAMES = sorted(requests(*heavy(0)))


@pytest.mark.parametrize("name", NAMES)
def test_whatever_is_asked(name):
    for seed in range(2):
        model, q, v, x = heavy(seed)
        call = requests(model, q, v, x)[name]
        truth = call(precision="quad")
        for form in FACTORED:
            # ∂D of a light link near the tip is right to epsilon of the tip's inertia, 1e9 times its own
            bound = 10 * 1e9 * np.finfo(float).eps if name == "ln det" else 1e-10
            assert relative(call(form=form), truth) < bound, (seed, form, relative(call(form=form), truth))


def test_a_wider_precision_keeps_more():
    model, q, _, x = heavy(0)
    op = inverse(model).diff(6)
    truth = op.at(q, precision=50) @ x
    assert relative(op.at(q, form="ud", precision="extended") @ x, truth) < 1e-13
    assert relative(op.at(q, form="ud", precision=50) @ x, truth) < 1e-15


# ---------------------------------------------------------------------- hinges of every kind


def every_kind(seed=4):
    model = pc.tree(PARENTS, KINDS, seed=seed)
    model.hinges["hinge1"].rotor_inertia = [0.7]
    state = model.random_state(3)
    model.q, model.v = state.q, state.v
    return model


@pytest.mark.parametrize("form", FORMS)
def test_every_kind_of_hinge(form):
    """Coordinates, time, and twists of hinges with one subhinge and with several, against quad precision."""
    model = every_kind()
    q, v, x = model.q, model.v, np.random.default_rng(0).normal(size=model.nv)
    op, scale = inverse(model), np.abs(inverse(model).at(model.q) @ x).max()
    tangents = [op.diff(i) for i in range(model.nv)] + [op.dot()]
    for hinge in model.hinges.values():
        tangents += [op.diff(hinge.symbol("placement", c)) for c in ("ry", "z")]
        if len(hinge.subhinges) > 1 and hinge.subhinges[1].get("kind") == "pin":
            tangents += [op.diff(hinge.symbol("axis", "x", 1)), op.diff(hinge.symbol("point", "y", 1))]
    for tangent in tangents:
        bound = {how: tangent.at(q, v, **options) for how, options in (("form", dict(form=form)), ("quad", dict(precision="quad")))}
        assert relative(bound["form"] @ x, bound["quad"] @ x, scale) < 1e-11, tangent.text()


def test_the_step_is_there_in_factored_forms_alone():
    model = every_kind()
    op = inverse(model).diff(9)
    assert STEP in steps_of(op.at(model.q, form="ud")) and STEP in steps_of(op.at(model.q, form="square-root"))
    assert STEP not in steps_of(op.at(model.q)) and STEP not in steps_of(op)
    assert STEP not in steps_of(op.at(model.q, form="ud", precision=100))
    inner = next(h for h in model.hinges.values() if len(h.subhinges) > 2)
    assert STEP in steps_of(inverse(model).diff(inner.symbol("placement", "x")).at(model.q, form="ud"))
    amid = inverse(model).diff(inner.symbol("point", "x", 1))  # computed as typed: right, to what `fast` has
    assert STEP not in steps_of(amid.at(model.q, form="ud"))
    assert STEP not in steps_of((model.soa.MM + 2 * model.soa.J).inv().diff(9).at(model.q, form="ud"))
    other = inverse(model) @ (2 * (model.soa.MM + model.soa.J).diff(9)) @ inverse(model)  # no ∂(ℳ + J)⁻¹, but twice that
    x = np.ones(model.nv)
    assert relative(other.at(model.q, form="ud") @ x, -2 * (op.at(model.q, form="ud") @ x)) < 1e-12


def test_where_the_sweep_has_no_derivative_what_was_typed_is_computed():
    """Point masses in a row on crossed axes: P⁺ has lost a direction at this configuration alone."""
    model = pc.Multibody("row")
    for k, axis in enumerate(([0, 0, 1.0], [0, 1.0, 0], [0, 0, 1.0], [0, 1.0, 0])):
        model.add_body(f"b{k}", f"b{k - 1}" if k else None, axis=axis, position=(1.0 if k else 0, 0, 0), mass=1.0, com=(0.5, 0, 0))
    q, x = np.zeros(4), np.array([1.0, 2, 3, 4])
    for i in range(1, 4):
        op = inverse(model).diff(i)
        truth = op.at(q, precision="quad") @ x
        for form in FACTORED:
            got = op.at(q, form=form) @ x
            assert np.isfinite(got).all() and np.abs(got - truth).max() < 1e-12 * (1 + np.abs(truth).max())
            batch = op.at(np.array([q, q + 0.3, q]), form=form) @ x
            assert np.array_equal(batch[0], got) and np.array_equal(batch[2], got)


def test_a_changed_model_is_seen():
    """Neither the masses nor the state of the run before are kept."""
    model = every_kind()
    x = np.ones(model.nv)
    op = inverse(model).diff(9)
    body, hinge = model.bodies["body4"], model.hinges["hinge1"]
    for owner, name, value in ((body, "mass", body.mass), (body, "mass", 3.0), (hinge, "rotor_inertia", [0.2])):
        setattr(owner, name, value)
        for q in (model.q, model.random_state(8).q):
            assert relative(op.at(q, form="ud") @ x, op.at(q, precision="quad") @ x) < 1e-11
