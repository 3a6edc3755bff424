"""When D(k) counts as singular, by form (ruling 12): each form is judged by its own rounding bound.

`fast` takes differences of inertias: what is below eps of the locked inertia is noise to it. `ud` and `square-root` carry factors: a
pivot of D is a sum of squares of numbers that are good to eps, so it means something down to eps². Both refuse what is zero exactly.
"""

import mpmath
import numpy as np
import pytest

import pycraft as pc
from support.descriptions import subhinge
from support.exact_accelerations import drawn, exact_accelerations, floor, heavy_tip, relative_error
from support.forms import FORMS, epsilon
from support.formulas import EPS
from support.oracle import reference
from support.singular_hinges import REGULAR, ROUNDED, SINGULAR, SKEW, at_random_state, links, what_needs_D

FACTORED = ("ud", "square-root")
each_form = pytest.mark.parametrize("form", FORMS)


def everyday(*names, slow):
    """Parameters of the everyday subset, and those that are left to the full run."""
    return [*names, *(pytest.param(name, marks=pytest.mark.slow) for name in slow)]


def needs_D(arm, form, precision):
    """Everything that needs D⁻¹, in one form and precision, as calls."""
    H, phi, M, J, D, G, K, psi, Upsilon, Omega = arm.soa("H phi M J D G K psi Upsilon Omega")
    total = H @ phi @ M @ phi.T @ H.T + J
    x, zero, at = np.ones(arm.nv), np.zeros(arm.nv), dict(form=form, precision=precision)
    made = {name: op.at(arm.q, **at).dense for name, op in dict(D=D, G=G, K=K, ψ=psi, Υ=Upsilon, Ω=Omega).items()}
    return made | {
        "ℳ⁻¹": lambda: total.inv().at(arm.q, **at) @ x,
        "ln det D": lambda: float(D.logdet().at(arm.q, **at)),
        "forward dynamics": lambda: arm.forward_dynamics(arm.q, zero, x, **at),
        "refined": lambda: arm.forward_dynamics(arm.q, zero, x, refine=1, **at),
        "mass matrix inverse": lambda: arm.mass_matrix_inverse(arm.q, **at),
    }


# ---------------------------------------------------------------------- what every form refuses


@each_form
@pytest.mark.parametrize("precision", everyday("double", "quad", slow=["single", "extended", 50]))
@pytest.mark.parametrize("name", SINGULAR)
def test_what_is_singular_is_refused_by_name(name, precision, form):
    if name in ROUNDED and precision not in ("single", "double"):
        pytest.skip("regular to that precision")
    describe, fault = SINGULAR[name]
    arm = at_random_state(describe(), 1)
    for what, call in needs_D(arm, form, precision).items():
        text = f"hinge '{fault}_hinge' of body '{fault}' feels no inertia along coordinate '{fault}_hinge"
        with pytest.raises(pc.SingularHingeError, match=text):
            pytest.fail(f"{what} gave {call()}")


@each_form
@pytest.mark.parametrize("precision", everyday("double", slow=["single"]))
@pytest.mark.parametrize("name", SINGULAR)
def test_no_state_slips_through(name, precision, form):
    """Noise of pivots is refused at every state, not at most of them."""
    arm = at_random_state(SINGULAR[name][0]())
    let_through = []
    for seed in range(100):
        q = arm.random_state(seed).q
        try:
            let_through.append((seed, np.abs(arm.mass_matrix_inverse(q, form=form, precision=precision)).max()))
        except pc.SingularHingeError:
            continue
    assert not let_through, f"{len(let_through)} of 100 states, entries of the inverse up to {max(x for _, x in let_through):.1e}"


@each_form
@pytest.mark.parametrize("name", SINGULAR)
def test_blocks_of_any_size_judge_alike(name, form):
    describe, fault = SINGULAR[name]
    arm = at_random_state(describe(), 2)
    tree = bare_tree(arm)
    with pytest.raises(pc.SingularHingeError, match=f"'body{fault[1:]}'"):
        pytest.fail(f"D is {tree.D.at(form=form).dense()}")


def bare_tree(arm):
    """The same mechanism at its state as blocks of numbers."""
    o = reference.operators(arm.description(), arm.q)
    E = [None if p < 0 else o.E[o.states[p], o.states[k]] for k, p in enumerate(o.parents)]
    H = [o.H[t, s] for t, s in zip(o.coordinates, o.states, strict=True)]
    M = [(o.M[s, s] + o.M[s, s].T) / 2 for s in o.states]
    return pc.sko_model(o.parents, E, H, M, [o.J[t, t] for t in o.coordinates])


@pytest.mark.parametrize("batch", [1, 3, 16])
@each_form
def test_batches_name_the_state(batch, form):
    """A singular state in a batch is refused as it is alone, in packs too."""
    arm = at_random_state(SINGULAR["massless ball under a pin"][0]())
    Q = np.array([arm.random_state(seed).q for seed in range(batch)])
    zero = np.zeros((batch, arm.nv))
    with pytest.raises(pc.SingularHingeError, match="'b0_hinge' of body 'b0'"):
        arm.forward_dynamics(Q, zero, zero + 1, form=form)


# ---------------------------------------------------------------------- what every form solves


@each_form
@pytest.mark.parametrize("precision", everyday("double", slow=["extended", "quad", 50]))
@pytest.mark.parametrize("name", REGULAR)
def test_what_is_only_extreme_is_solved(name, precision, form):
    """By factors to the same digits whatever the ratio; by differences, to what the ratio leaves."""
    arm = at_random_state(REGULAR[name]())
    for what, call in needs_D(arm, form, precision).items():
        try:
            assert np.isfinite(call()).all(), what
        except pc.RefinementError:
            assert what == "refined" and form == "fast"
    x = np.random.default_rng(0).normal(size=arm.nv)  # equal torques would be one couple on a heavy tip, which cancels nearly all motion
    got = arm.forward_dynamics(arm.q, 0 * x, x, form=form, precision=precision)
    exact = exact_accelerations(arm, arm.q, 0 * x, x)
    # "grams and micrometres" hangs links of 1e-6 m on arms of 1 m: eps (1e6)² of what is left of D, eps 1e6 of its root
    allowed = {"grams and micrometres": 1e12, "tip 1e12 times heavier": 1e14, "tip 1e6 times heavier": 1e8}.get(name, 1e4)
    factored = {"grams and micrometres": 1e6}.get(name, 1e4)
    assert relative_error(got, exact) <= (allowed if form == "fast" else factored) * epsilon(precision) + EPS


# ---------------------------------------------------------------------- where the forms differ


def sliders(inner, outer, axis=(1, 0, 0)):
    """A carriage on a carriage along one line: m₀θ̈₀ = T₀ − T₁, m₁(θ̈₀ + θ̈₁) = T₁."""
    return at_random_state(links(*[([subhinge("slider", axis)], dict(mass=mass, inertia=np.eye(3))) for mass in (inner, outer)]))


def two_carriages(inner, outer, T):
    with mpmath.workdps(60):
        m0, m1, T0, T1 = (mpmath.mpf(x) for x in (inner, outer, *T))
        first = (T0 - T1) / m0
        return np.array([first, T1 / m1 - first])


@pytest.mark.parametrize("axis", [(1, 0, 0), SKEW], ids=["along x", "askew"])
@pytest.mark.parametrize(("inner", "outer"), [(1e-3, 1e9), (1e-3, 1e16), (1.0, 1e18), (1e-9, 1e9)])
def test_a_light_carriage_under_a_heavy_one(inner, outer, axis):
    """The remainder of D is the light mass; factors have it, differences only above their rounding. Of G factors have a digit askew as
    long as the ratio is above eps, and D is not enough: what falls with its base would have none."""
    arm = sliders(inner, outer, axis)
    T = np.array([3.0, -2.0])
    exact = two_carriages(inner, outer, T)
    for form in FACTORED:
        if axis == SKEW and inner / outer < EPS:
            with pytest.raises(pc.SingularHingeError, match="'b0_hinge' of body 'b0'"):
                pytest.fail(str(arm.forward_dynamics(arm.q, [0, 0], T, form=form)))
            continue
        got = arm.forward_dynamics(arm.q, [0, 0], T, form=form)
        # askew, a root of D is good to eps of the heavy one's: D to (eps √(outer/inner)) twice
        allowed = 1e2 * EPS * (1 if axis == (1, 0, 0) else np.sqrt(outer / inner))
        assert relative_error(got, exact) <= allowed, form
        H, phi, M = arm.soa("H phi M")
        assert relative_error((H @ phi @ M @ phi.T @ H.T).inv().at(arm.q, form=form) @ T, exact) <= allowed, form
        assert abs(float(arm.soa.D.logdet().at(arm.q, form=form)) - np.log(inner) - np.log(outer)) <= 100 * EPS + 2 * allowed
    if inner / outer < EPS and axis == SKEW:
        with pytest.raises(pc.SingularHingeError, match="'b0_hinge' of body 'b0'"):
            pytest.fail(str(arm.forward_dynamics(arm.q, [0, 0], T)))
    else:
        answer = arm.forward_dynamics(arm.q, [0, 0], T) if inner / outer >= 1e2 * EPS else None
        if answer is not None:
            assert relative_error(answer, exact) <= 1e2 * EPS * outer / inner


@each_form
@pytest.mark.parametrize("axis", [(1, 0, 0), SKEW], ids=["along x", "askew"])
@pytest.mark.parametrize(("inner", "outer"), [(1e-3, 1e6), (1e-3, 1e9), (1e-3, 1e16), (1.0, 1e18), (1e-9, 1e9), (1e-9, 1e16)])
def test_carriages_that_fall_with_their_base(inner, outer, axis, form):
    """Gravity, and forces that leave none or little: at least a digit right, or refused. Where the answer is exactly zero no digit is: what
    is left then is rounding of gravity, of which all accelerations here are made."""
    arm = sliders(inner, outer, axis)
    arm.gravity = (0, 0, -9.81)
    for T in (np.zeros(2), np.array([3.0, -2.0])):
        try:
            got = arm.forward_dynamics(arm.q, [0, 0], T, form=form)
        except pc.SingularHingeError:
            assert inner / outer < 1e2 * EPS and (form == "fast" or axis == SKEW)
            continue
        exact = arm.forward_dynamics(arm.q, [0, 0], T, form="ud", precision=50)
        assert np.linalg.norm(got - exact) <= (0.5 * np.linalg.norm(exact) if exact.any() else EPS * 9.81)


@each_form
@pytest.mark.parametrize("axis", [(1, 0, 0), SKEW], ids=["along x", "askew"])
@pytest.mark.parametrize("outer", [1.0, 1e9, 1e16])
def test_a_massless_carriage_under_any(outer, axis, form):
    arm = sliders(0.0, outer, axis)
    with pytest.raises(pc.SingularHingeError, match="'b0_hinge' of body 'b0'"):
        pytest.fail(str(arm.forward_dynamics(arm.q, [0, 0], [3.0, -2.0], form=form)))


@each_form
def test_never_a_wild_number_in_silence(form):
    """From regular to singular by halves of a decade: within a digit of what the form's bound promises, or refused; and once
    refused, refused from there on."""
    refused = False
    for decade in np.arange(0, 40, 0.5):
        inner = 10.0**-decade
        arm = sliders(inner, 1.0, SKEW)
        T = np.array([1.0, -1.0]) * inner
        try:
            got = arm.forward_dynamics(arm.q, [0, 0], T, form=form)
        except pc.SingularHingeError:
            refused = True
            continue
        assert not refused, f"accepted again at 1e-{decade}"
        assert relative_error(got, two_carriages(inner, 1.0, T)) <= 0.5
    assert refused


@pytest.mark.parametrize("ratio", [1e6, 1e9, 1e12, 1e15])
@pytest.mark.parametrize("form", FACTORED)
def test_heavy_tips(form, ratio):
    """To 1e15, with velocities and gravity, unrefined."""
    multibody = heavy_tip(ratio)
    for seed in range(3):
        draw = drawn(multibody, seed)
        found = relative_error(multibody.forward_dynamics(*draw, form=form), exact_accelerations(multibody, *draw))
        assert found <= 10 * floor(10), found


def test_a_wider_precision_solves_what_a_form_must_refuse():
    """The message states it, and it is true: `fast` in quad at a ratio of 1e19."""
    arm = sliders(1e-3, 1e16, SKEW)
    T = np.array([3.0, -2.0])
    with pytest.raises(pc.SingularHingeError) as error:
        arm.forward_dynamics(arm.q, [0, 0], T)
    assert "ud" in str(error.value) or "precision" in str(error.value), error.value
    assert relative_error(arm.forward_dynamics(arm.q, [0, 0], T, precision="quad"), two_carriages(1e-3, 1e16, T)) <= 1e-12


def rod_inertia(axis, mass, share):
    """A rod of 1 m along a unit axis, with this share of mass · 1 m² about it."""
    inertia = mass * ((np.eye(3) - np.outer(axis, axis)) / 12 + share * np.outer(axis, axis))
    return (inertia + inertia.T) / 2


def right_or_refused(arm, q, tau, form):
    """Check that there is a result; it has at least one correct digit."""
    try:
        got = arm.forward_dynamics(q, np.zeros(arm.nv), tau, form=form)
    except pc.SingularHingeError:
        return False
    exact = arm.forward_dynamics(q, np.zeros(arm.nv), tau, form="ud", precision=50)
    assert relative_error(got, exact) <= 0.5, f"{form}: {got} instead of {exact}"
    return True


@each_form
@pytest.mark.parametrize("share", [0.0, 1e-17, 1e-16, 1e-15, 1e-14])
def test_a_rod_about_its_own_axis_askew(share, form):
    """H M H* is the rounding of M's entries, or little more: refused, or right, for any axis."""
    answers = 0
    for seed in range(60):
        rng = np.random.default_rng(seed)
        axis = rng.normal(size=3)
        axis /= np.linalg.norm(axis)
        arm = pc.Multibody("rod")
        arm.add_body("base", None, "pin", mass=1.0, axis=rng.normal(size=3), com=rng.normal(size=3), inertia=np.eye(3))
        rod = dict(mass=1.0, com=0.5 * axis, inertia=rod_inertia(axis, 1.0, share))
        arm.add_body("rod", "base", "pin", axis=axis, position=rng.normal(size=3), **rod)
        answers += right_or_refused(arm, rng.normal(size=2), np.ones(2), form)
    # Factors know the rounding of the inertia's entries as an inertia where it exceeds 2 eps of them; the plain form never does.
    assert answers <= (6 if form == "fast" else 30) if share == 0 else answers >= 54 if share == 1e-14 else True


def nearly_dependent(rng):
    """A tree of hinges that nearly undo each other: axes off by 1e-12 to 0.1, thin rods, massless links, masses from 1e-9 to 1e9."""
    arm = pc.Multibody("nearly dependent")
    axis, name = None, None
    for k in range(rng.integers(2, 6)):
        kind = str(rng.choice(["pin", "pin", "pin", "slider", "universal", "gimbal"]))
        turned = rng.normal(size=3) if axis is None or rng.random() < 0.4 else axis + 10.0 ** rng.uniform(-12, -1) * rng.normal(size=3)
        axis = turned / np.linalg.norm(turned)
        mass, choice, options = 10.0 ** rng.uniform(-9, 9), rng.random(), {}
        if choice > 0.6:
            root = rng.normal(size=(3, 3))
            options = dict(mass=mass, com=rng.normal(size=3), inertia=mass * (np.trace(root @ root.T) * np.eye(3) - root @ root.T))
        elif choice > 0.25:
            along = axis + 10.0 ** rng.uniform(-8, 0) * rng.normal(size=3)
            along /= np.linalg.norm(along)
            options = dict(mass=mass, com=0.5 * along, inertia=rod_inertia(along, mass, 10.0 ** rng.uniform(-16, -2)))
        if kind in ("pin", "slider"):
            options["axis"] = axis
        position = rng.normal(size=3) if rng.random() < 0.6 else np.zeros(3)
        arm.add_body(f"b{k}", name, kind, position=position, **options)
        name = f"b{k}"
    arm.take_warnings()
    return arm


@each_form
@pytest.mark.parametrize("seeds", everyday(150, slow=[1500]))
def test_hinges_that_nearly_undo_each_other(seeds, form):
    answers = 0
    for seed in range(seeds):
        rng = np.random.default_rng(seed)
        try:
            arm = nearly_dependent(rng)
        except pc.ModelError:  # an inertia beyond rounding
            continue
        q = rng.normal(size=arm.nv) * np.where(rng.random(arm.nv) < 0.6, 10.0 ** rng.uniform(-10, 0), 1.0)
        answers += right_or_refused(arm, q, rng.normal(size=arm.nv), form)
    assert answers > seeds / 2


def test_what_leaves_the_range_of_its_numbers_is_no_result():
    """Overflow raises an error that names it, in every form, method and batch; no hinge is blamed for it."""
    arm = pc.Multibody("rotor on an arm")
    arm.add_body("arm", None, "pin", mass=1.0, axis=(0, 0, 1), com=(0.5, 0, 0), inertia=np.eye(3))
    rotor = dict(mass=1.0, com=(0.3, 0.1, 0.2), inertia=np.diag([1.0, 2.0, 2.5]))
    arm.add_body("rotor", "arm", "pin", axis=(0, 1, 0), position=(1, 0.2, 0), **rotor)
    arm = at_random_state(arm.description())
    x = np.ones(arm.nv)
    for form in FORMS:
        for options in (dict(), dict(precision="single"), dict(refine=1)):
            with pytest.raises(pc.Error, match="range|overflows"):
                arm.forward_dynamics(arm.q, 1e160 * x, x, form=form, **options)
    for method in ("cholesky", "ldl", "inverse", "divide-and-conquer", "realization"):
        with pytest.raises(pc.Error, match="range|overflows|positive definite"):
            arm.forward_dynamics(arm.q, 1e160 * x, x, method=method)
    states = np.tile(arm.q, (9, 1)), np.tile(x, (9, 1)), np.tile(x, (9, 1))
    states[1][7] *= 1e160
    with pytest.raises(pc.EvaluationError, match="state 7 of a batch of 9"):
        arm.forward_dynamics(*states)
    with pytest.raises(pc.EvaluationError, match="range"):
        arm.inverse_dynamics(arm.q, 1e160 * x, x)
    with pytest.raises(pc.EvaluationError, match="range"):
        (1e10 * arm.soa.M).at(arm.q) @ (1e308 * np.ones(6 * len(arm.bodies)))


@pytest.mark.parametrize("at", [2, 8])
@pytest.mark.parametrize("form", ["fast", "ud", "square-root"])
def test_a_batch_names_the_state(form, at):
    """Within a pack, and in what is left after the packs."""
    arm = pc.Multibody("two pins")
    arm.add_body("inner", None, "pin", mass=0.0, axis=(0, 0, 1))
    arm.add_body("middle", "inner", "pin", mass=0.0, axis=(1, 0, 0))
    arm.add_body("outer", "middle", "pin", mass=1.0, axis=(0, 0, 1), com=(0.3, 0.1, 0.2), inertia=np.eye(3))
    arm.take_warnings()
    q = np.full((9, 3), 0.7)
    q[at, 1] = 0.0  # the axes of inner and outer fall in line
    with pytest.raises(pc.SingularHingeError, match=f"'inner'.*state {at} of a batch of 9"):
        arm.forward_dynamics(q, 0 * q, 0 * q, form=form)
    with pytest.raises(pc.SingularHingeError, match=f"'inner'.*state {at} of a batch of 9"):
        arm.soa.D.inv().at(q, form=form).dense()


# ---------------------------------------------------------------------- minimum norm


def test_everything_that_needs_D_is_covered():
    """The list here has what the list of test_singular_hinges has."""
    arm = at_random_state(REGULAR["near its axis"]())
    assert set(what_needs_D(arm, "double")) <= {*needs_D(arm, "fast", "double"), "K", "ψ"}
