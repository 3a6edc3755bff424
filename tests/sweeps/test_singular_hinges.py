"""When D(k) counts as singular (ruling 12): where its pivot is noise of the sweep that made it, and never where it is only small."""

import numpy as np
import pytest

import pycraft as pc
from support.formulas import EPS, letters_of, norm
from support.oracle import reference
from support.singular_hinges import REGULAR, SINGULAR, at_random_state, what_needs_D


@pytest.mark.parametrize("precision", ["double", "extended", "quad"])
@pytest.mark.parametrize("name", REGULAR)
def test_what_is_only_extreme_is_solved(name, precision):
    arm = at_random_state(REGULAR[name]())
    for what, call in what_needs_D(arm, precision).items():
        assert np.isfinite(call()).all(), what
    letters_of(arm).D.assert_close(arm.soa.D.dense())


@pytest.mark.parametrize("precision", ["double", "extended", "quad"])
@pytest.mark.parametrize("name", SINGULAR)
@pytest.mark.parametrize("seed", range(3))
def test_what_is_singular_is_refused_by_name(name, precision, seed):
    describe, fault = SINGULAR[name]
    arm = at_random_state(describe(), seed)
    for what, call in what_needs_D(arm, precision).items():
        text = f"hinge '{fault}_hinge' of body '{fault}' feels no inertia along coordinate '{fault}_hinge"
        with pytest.raises(pc.SingularHingeError, match=text):
            pytest.fail(f"{what} gave {call()}")
    with pytest.raises(ArithmeticError):
        pytest.fail(str(reference.operators(arm.description(), arm.q).D))


@pytest.mark.parametrize("name", ["massless ball under a pin", "seven coordinates of one body", "point on a ball, skew"])
def test_no_state_slips_through(name):
    """Noise of several pivots in one hinge: refused at every state, not at most of them."""
    arm = at_random_state(SINGULAR[name][0]())
    let_through = []
    for seed in range(100):
        q = arm.random_state(seed).q
        try:
            let_through.append((seed, np.abs(arm.mass_matrix_inverse(q)).max()))
        except pc.SingularHingeError:
            continue
    assert not let_through, f"{len(let_through)} of 100 states, entries of the inverse up to {max(x for _, x in let_through):.1e}"


@pytest.mark.parametrize("name", SINGULAR)
def test_what_needs_no_inverse_works_all_the_same(name):
    arm = at_random_state(SINGULAR[name][0]())
    o = reference.operators(arm.description(), arm.q)
    for name in ("phi", "R", "H", "M"):
        expected = getattr(o, name)
        assert np.abs(getattr(arm.soa, name).dense() - expected).max() <= 500 * EPS * norm(expected) * norm(o.phi)
    assert np.abs(arm.mass_matrix(arm.q) - o.mass_matrix).max() <= 500 * EPS * norm(o.R) * norm(o.phi) ** 2
    assert np.isfinite(arm.inverse_dynamics(arm.q, arm.v, arm.v)).all()


@pytest.mark.parametrize("name", [*REGULAR, *SINGULAR])
def test_blocks_of_any_size_judge_alike(name):
    """The same mechanism as a bare tree of matrices: the other block policy, the same verdict."""
    describe = REGULAR[name] if name in REGULAR else SINGULAR[name][0]
    arm = at_random_state(describe())
    o = reference.operators(arm.description(), arm.q)
    E = [None if p < 0 else o.E[o.states[p], o.states[k]] for k, p in enumerate(o.parents)]
    H = [o.H[t, s] for t, s in zip(o.coordinates, o.states, strict=True)]
    M = [(o.M[s, s] + o.M[s, s].T) / 2 for s in o.states]
    tree = pc.sko_model(o.parents, E, H, M, [o.J[t, t] for t in o.coordinates])
    if name in REGULAR:
        assert np.isfinite(tree.D.dense()).all()
    else:
        with pytest.raises(pc.SingularHingeError, match=f"'body{SINGULAR[name][1][1:]}'"):
            pytest.fail(f"D is {tree.D.dense()}")
