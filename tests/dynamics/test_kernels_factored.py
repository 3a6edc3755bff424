"""Forward dynamics by kernels in the forms that carry factors (cpp/kernels/factored_dynamics.h) and in precisions wider than double: a
batch is its states, digits and refusals equal the general recursions'.

Errors are relative 2-norms of a state's accelerations. What is left of them where nothing cancels is some roundings of the sweeps: eps √n
and a few.
"""

import numpy as np
import pytest

import pycraft as pc
from support.forms import FACTORED, heavy_tip
from support.kernel_cases import MODELS, STATES, by_recursions, errors, heavy, states

EPS = np.finfo(float).eps
STEPS = {"": {}, ", one": {"refine": 1}, ", auto": {"refine": "auto"}, ", gather": {"refine": 1, "residual": "gather"}}
WAYS = {f"{form}{name}": {"form": form, **how} for form in FACTORED for name, how in STEPS.items()}
WIDE = {precision: {"precision": precision} for precision in ("extended", "quad")}
REFERENCE = {"extended": "quad", "quad": "50"}
each_form = pytest.mark.parametrize("form", FACTORED)


@pytest.fixture(params=[name for name, model in MODELS.items() if model.nv])
def model(request):
    model = MODELS[request.param]
    model.gravity = (0.4, -1.0, -9.0)
    return model


@pytest.mark.parametrize("way", [*WAYS, *WIDE])
def test_a_batch_is_its_states(model, way):
    """Whole packs, what is left of one, on one thread and on two."""
    Q, V, U = states(model, 19)
    how = (WAYS | WIDE)[way]
    alone = np.array([model.forward_dynamics(*one, **how) for one in zip(Q, V, U, strict=True)])
    for count in (19, STATES, 3):
        np.testing.assert_array_equal(model.forward_dynamics(Q[:count], V[:count], U[:count], **how), alone[:count])
    np.testing.assert_array_equal(model.forward_dynamics(Q, V, U, threads=2, **how), alone)


@pytest.mark.parametrize("ratio", [1.0, 1e3, 1e9, 1e15])
@each_form
def test_digits_of_the_general_recursions(model, form, ratio):
    """At any ratio of masses half of the states are as near. Roundings of a single one, and of the worst tenth, are a matter of
    chance and of the processor's instructions, by 8; a correction of a few roundings is left out."""
    model = heavy(model, ratio)
    given = states(model, 40)
    floor = np.array([4, 16, 32]) * EPS * np.sqrt(model.nv)
    for name, how in WAYS.items():
        if how["form"] != form:
            continue
        try:
            general = errors(model, given, call=by_recursions, **how)
        except (pc.SingularHingeError, pc.RefinementError) as refused:
            with pytest.raises(type(refused)) as error:
                model.forward_dynamics(*given, **how)
            assert str(error.value) == str(refused), name
            continue
        own, there = (np.percentile(x, [50, 90, 100]) for x in (errors(model, given, **how), general))
        assert (own <= [2, 8, 8] * there + floor).all(), (name, own, there)


@each_form
def test_heavy_tips_cost_no_digits(form):
    """Batches of a chain whose plain form has lost what the ratio says."""
    for ratio in (1e4, 1e8, 1e12):
        lost, left, corrected = [], [], []
        for seed in range(4):
            arm = heavy_tip(seed, ratio)[0]
            given = states(arm, 19)
            lost.append(errors(arm, given).max())
            left.append(errors(arm, given, form=form).max())
            corrected.append(errors(arm, given, form=form, refine=1).max())
        assert max(lost) > 0.1 * ratio * EPS
        assert max(left) <= 2e-13 and max(corrected) <= 2e-13, (ratio, left, corrected)


def test_kernels_are_what_runs():
    """The reference rounds independently of the general recursions' bits. Wider numbers show this where a heavy tip has cost
    digits."""
    ways = [*WAYS.values(), *({**how, "precision": "single"} for how in WAYS.values() if "refine" not in how), *WIDE.values()]
    for how in ways:
        model = heavy(MODELS["chain of 30"], {"extended": 1e8, "quad": 1e22}.get(how.get("precision"), 1.0))
        given = states(model)
        assert (model.forward_dynamics(*given, **how) != by_recursions(model, *given, **how)).any(), how


@pytest.mark.parametrize(("precision", "ratio"), [("extended", 1e7), ("quad", 1e22)])
def test_wide_numbers_have_all_their_digits(model, precision, ratio):
    """The loss from heavy tips shows the number of digits of a computation: the general recursions lose as much."""
    for times in (1.0, ratio):
        tipped = heavy(model, times)
        given = states(tipped)
        general, own = (
            errors(tipped, given, REFERENCE[precision], precision=precision, on_singular=how) for how in ("minimum-norm", "raise")
        )
        assert own.max() <= max(4 * general.max(), 2 * EPS), times


@pytest.mark.parametrize(("precision", "ratio"), [("extended", 1e10), ("quad", 1e22)])
def test_wide_numbers_go_beyond_a_double(precision, ratio):
    """As far as their epsilon times the ratio: a double has nothing left of these."""
    epsilon = {"extended": 2.0**-63, "quad": 2.0**-112}[precision]
    lost = []
    for seed in range(6):
        arm = heavy_tip(seed, ratio)[0]
        lost.append(errors(arm, states(arm), "100", precision=precision).max())
    assert 4 * EPS < max(lost) <= 100 * ratio * epsilon


def off_axis():
    """A point mass that a slider carries away from the axis of a pin, hardly: where it lies on that, the pin feels nothing."""
    arm = pc.Multibody("off an axis")
    arm.add_body("a", mass=1.0, com=(0.5, 0, 0), inertia=0.1 * np.eye(3))
    arm.add_body("b", "a", axis=(1, 0, 0), position=(1, 0, 0))
    arm.add_body("c", "b", hinge="slider", axis=(0, 1, 0), mass=1.0, com=(0.5, 0, 0))
    arm.gravity = (0, 0, -9.8)
    return arm


SMALL = 10.0 ** -np.arange(1, 17)


def answer(arm, one, how):
    """Of a state alone, None: refused."""
    try:
        return arm.forward_dynamics(*one, **how)
    except (pc.SingularHingeError, pc.RefinementError):
        return None


@pytest.mark.parametrize("way", ["ud", "square-root", "ud, one", "square-root, gather", "extended", "quad"])
def test_doubted_states_in_a_batch(way):
    """Beside others, in every lane, on threads: the bits that they have alone, with six digits at least, or the error that they have."""
    arm, how = off_axis(), (WAYS | WIDE)[way]
    Q, V, U = states(arm, 5 * len(SMALL))
    Q[:, 2] = np.tile(np.where(np.arange(5) < 2, 0.3, 1), len(SMALL)) * np.repeat(SMALL, 5)
    Q[::5, 2] = 0.4  # regular ones between
    alone = [answer(arm, one, how) for one in zip(Q, V, U, strict=True)]
    there = [b for b, found in enumerate(alone) if found is not None]
    assert set(range(0, len(Q), 5)) < set(there)
    exact = arm.forward_dynamics(Q, V, U, precision="100")
    for b in there:
        assert np.linalg.norm(alone[b] - exact[b]) <= 1e-6 * np.linalg.norm(exact[b]), Q[b, 2]
    for threads in (1, 2):
        found = arm.forward_dynamics(Q[there], V[there], U[there], threads=threads, **how)
        np.testing.assert_array_equal(found, np.array([alone[b] for b in there]))
    for shift in range(5):
        part = slice(shift, None, 2)
        first = next((i for i, found in enumerate(alone[part]) if found is None), None)
        if first is not None:
            with pytest.raises(pc.SingularHingeError, match=f"state {first} of"):
                arm.forward_dynamics(Q[part], V[part], U[part], **how)
    Q[7, 2] = 0
    with pytest.raises(pc.SingularHingeError, match=r"'b(_hinge)?' of body 'b'(.|\n)*state 7 of"):
        arm.forward_dynamics(Q[: 7 + 5], V[: 7 + 5], U[: 7 + 5], **how)


@pytest.mark.parametrize(("precision", "most"), [("extended", 1e-17), ("quad", 1e-30)])
def test_reports_of_wide_numbers_start_from_all_their_digits(precision, most):
    """Results of kernels are rounded to doubles: a refinement with more digits does not start from them."""
    model = MODELS["chain of 30"]
    q, v, u = (x[0] for x in states(model))
    report = model.refinement(q, v, u, refine=1, residual="wider", precision=precision)
    assert report["error"] <= most and max(report["corrections"], default=0) <= most
