"""The Kalman dictionary against the classic filter and smoother of statsmodels, and against conditioning of the joint Gaussian.

The joint Gaussian of all states and measurements is formed densely by NumPy; what it says of the states given the measurements needs
no recursion at all. Tolerances are roundings times the condition number of the covariance of the measurements.
"""

import re

import numpy as np
import pytest

import pycraft as pc
from pycraft.kalman import Dictionary, kalman

EPS = np.finfo(float).eps


def covariance(rng, n, rank=None):
    """A random covariance, of full rank unless told."""
    x = rng.normal(size=(n, n if rank is None else rank))
    return x @ x.T / n + (0.1 * np.eye(n) if rank is None else 0)


def transition(rng, n, radius):
    """A random matrix of this spectral radius."""
    A = rng.normal(size=(n, n))
    return A * radius / np.abs(np.linalg.eigvals(A)).max()


def system(seed, n=3, m=2, p=2, steps=12, radius=0.9, varying=False, rank=None):
    """Arguments of a random model."""
    rng = np.random.default_rng(seed)
    many = lambda make, count: np.array([make() for _ in range(count)]) if varying else make()
    return dict(
        A=many(lambda: transition(rng, n, radius), steps - 1),
        B=many(lambda: rng.normal(size=(n, p)), steps - 1),
        C=many(lambda: rng.normal(size=(m, n)), steps),
        Q=many(lambda: covariance(rng, p, rank), steps - 1),
        R=many(lambda: 0.2 * covariance(rng, m), steps),
        x0=rng.normal(size=n),
        P0=covariance(rng, n),
        steps=steps,
    )


SYSTEMS = {
    "stable": dict(seed=1),
    "unstable": dict(seed=2, radius=1.3),
    "varying": dict(seed=3, varying=True),
    "many outputs": dict(seed=4, n=2, m=5),
    "one output": dict(seed=5, n=4, m=1),
    "singular Q": dict(seed=6, p=3, rank=1),
    "no noise": dict(seed=7, p=2, rank=0),
    "one step": dict(seed=8, steps=1),
    "two steps, varying": dict(seed=9, steps=2, varying=True),
    "scalar": dict(seed=10, n=1, m=1, p=1),
}
each = pytest.mark.parametrize("name", SYSTEMS)


class Joint:
    """Mean and covariance of all states and measurements of a model, dense, forward in time."""

    def __init__(self, A, B, C, Q, R, x0, P0, steps):
        at = lambda x, t: x if x.ndim == 2 else x[t]
        n, m = at(A, 0).shape[0] if A.size else len(x0), at(C, 0).shape[0]
        self.n, self.m, self.steps = n, m, steps
        Phi = np.eye(steps * n)  # x = Phi (noises; first state)
        W = np.zeros((steps * n, steps * n))
        W[:n, :n] = P0
        mean = [x0]
        for t in range(steps - 1):
            rows, before = slice((t + 1) * n, (t + 2) * n), slice(t * n, (t + 1) * n)
            Phi[rows] += at(A, t) @ Phi[before]
            W[rows, rows] = at(B, t) @ at(Q, t) @ at(B, t).T
            mean.append(at(A, t) @ mean[-1])
        H = np.zeros((steps * m, steps * n))
        V = np.zeros((steps * m, steps * m))
        for t in range(steps):
            H[t * m : (t + 1) * m, t * n : (t + 1) * n] = at(C, t)
            V[t * m : (t + 1) * m, t * m : (t + 1) * m] = at(R, t)
        self.H, self.mean = H, np.concatenate(mean)
        self.states = Phi @ W @ Phi.T
        self.measurements = H @ self.states @ H.T + V

    def given(self, y, until):
        """Mean and covariance of all states given the measurements of the first `until` steps that are not NaN."""
        seen = np.isfinite(y.ravel()) & (np.arange(y.size) < until * self.m)
        H, S = self.H[seen], self.measurements[np.ix_(seen, seen)]
        gain = np.linalg.solve(S, H @ self.states).T if seen.any() else np.zeros((len(self.mean), 0))
        return self.mean + gain @ (y.ravel()[seen] - H @ self.mean), self.states - gain @ H @ self.states

    def log_likelihood(self, y):
        seen = np.isfinite(y.ravel())
        e, S = y.ravel()[seen] - self.H[seen] @ self.mean, self.measurements[np.ix_(seen, seen)]
        return -0.5 * (e @ np.linalg.solve(S, e) + np.linalg.slogdet(S)[1] + seen.sum() * np.log(2 * np.pi))

    def tolerance(self, y):
        """Rounding of the conditioning."""
        return (
            1e3
            * EPS
            * np.linalg.cond(self.measurements)
            * max(1.0, np.abs(self.states).max(), np.nanmax(np.abs(y)), np.abs(self.mean).max())
        )


def block(x, t, n):
    return x[t * n : (t + 1) * n, t * n : (t + 1) * n]


def made(name):
    """Model, joint Gaussian and a seeded series of measurements."""
    arguments = system(**SYSTEMS[name])
    space = kalman(**arguments)
    return space, Joint(**arguments), space.sample(SYSTEMS[name]["seed"])[1]


# ---------------------------------------------------------------------- against conditioning


@each
def test_filter_is_conditioning_on_the_past(name):
    space, joint, y = made(name)
    found, n, bound = space.filter(y), space.n, joint.tolerance(y)
    for t in range(space.steps):
        for until, state, covariance in (
            (t, found.predicted, found.predicted_covariance),
            (t + 1, found.filtered, found.filtered_covariance),
        ):
            mean, cov = joint.given(y, until)
            assert np.abs(state[t] - mean[t * n : (t + 1) * n]).max() <= bound
            assert np.abs(covariance[t] - block(cov, t, n)).max() <= bound
    assert found.log_likelihood == pytest.approx(joint.log_likelihood(y), rel=1e-9, abs=bound)
    assert space.log_likelihood(y) == pytest.approx(found.log_likelihood, rel=1e-14)


@each
def test_smoother_is_conditioning_on_everything(name):
    space, joint, y = made(name)
    found, n, bound = space.smooth(y), space.n, joint.tolerance(y)
    mean, cov = joint.given(y, space.steps)
    assert np.abs(found.states.ravel() - mean).max() <= bound
    for t in range(space.steps):
        assert np.abs(found.covariance[t] - block(cov, t, n)).max() <= bound
    backward = np.arange(space.steps * n).reshape(-1, n)[::-1].ravel()
    assert np.abs(space.posterior.dense()[np.ix_(backward, backward)] - cov).max() <= bound
    noise = np.diff(found.states, axis=0) if n == 0 else found.states[1:] - np.einsum("tij,tj->ti", space._A, found.states[:-1])
    assert np.abs(found.noise[1:] - noise).max(initial=0) <= bound
    assert np.abs(found.noise[0] - (found.states[0] - space.x0)).max() <= bound


@each
def test_the_covariance_of_the_measurements_is_the_mass_matrix(name):
    space, joint, _ = made(name)
    backward = np.arange(space.steps * space.m).reshape(-1, space.m)[::-1].ravel()
    expected = joint.measurements[np.ix_(backward, backward)]
    assert np.abs(space.covariance.dense() - expected).max() <= 1e2 * EPS * np.abs(joint.states).max() * joint.n**2
    assert float(space.covariance.logdet()) == pytest.approx(np.linalg.slogdet(expected)[1], rel=1e-8, abs=1e-8)


@each
def test_letters_are_what_the_dictionary_says(name):
    space, _, y = made(name)
    found, soa = space.filter(y), space.soa
    for t in range(space.steps):
        k = space.steps - 1 - t
        P, D, G = found.predicted_covariance[t], found.innovation_covariance[t], found.gain[t]
        C, R = space._C[t], space._R[t]
        assert np.allclose(D, C @ P @ C.T + R, rtol=1e-12, atol=1e-12 * np.abs(P).max())
        assert np.allclose(G @ D, P @ C.T, rtol=1e-9, atol=1e-9 * np.abs(P).max())
        rows, columns = slice(k * space.n, (k + 1) * space.n), slice(k * space.m, (k + 1) * space.m)
        assert np.allclose(soa.P.dense()[rows, rows], P, atol=1e-12 * np.abs(P).max())
        assert np.array_equal(soa.D.dense()[columns, columns], D)
        if t + 1 < space.steps:
            inboard = slice((k - 1) * space.n, k * space.n)
            assert np.array_equal(soa.E.dense()[inboard, rows], space._A[t])
            assert np.allclose(soa.K.dense()[inboard, columns], space._A[t] @ G, atol=1e-12 * max(1, np.abs(G).max()))
            assert np.allclose(found.predicted[t + 1], space._A[t] @ found.filtered[t], atol=1e-10 * max(1, np.abs(found.filtered).max()))
    expected = np.where(np.isfinite(y), y, 0) - np.einsum("tij,tj->ti", space._C, found.predicted)
    assert np.allclose(found.innovations, expected, atol=1e-9 * max(1, np.abs(found.predicted).max()))


@each
def test_theorems_are_theorems_of_filters(name):
    """ℳ + J and its innovations factors: whitening is exact, whatever the model."""
    space, _, _ = made(name)
    H, phi, psi, K, D, M, I = space.soa("H phi psi K D M I")
    S = I - H @ psi @ K
    for statement in ("inv(psi) == inv(phi) + K*H", "I - H*psi*K == inv(I + H*phi*K)", "M == P - E_psi*P*E.T"):
        assert pc.check(statement, space.soa), statement
    whitened = (S @ space.covariance @ S.T @ D.inv()).dense()
    assert np.abs(whitened - np.eye(len(whitened))).max() <= 1e3 * EPS * np.linalg.cond(space.covariance.dense())


# ---------------------------------------------------------------------- missing measurements


@pytest.mark.parametrize("seed", range(4))
def test_missing_measurements(seed):
    arguments = system(20 + seed, m=3, steps=10, varying=bool(seed % 2))
    space, joint = kalman(**arguments), Joint(**arguments)
    y = space.sample(seed)[1]
    rng = np.random.default_rng(seed)
    y[rng.uniform(size=y.shape) < 0.4] = np.nan
    y[4] = np.nan  # nothing at all
    filtered, smoothed, n, bound = space.filter(y), space.smooth(y), space.n, joint.tolerance(y)
    mean, cov = joint.given(y, 10)
    assert np.abs(smoothed.states.ravel() - mean).max() <= bound
    for t in range(10):
        past, past_cov = joint.given(y, t + 1)
        assert np.abs(filtered.filtered[t] - past[t * n : (t + 1) * n]).max() <= bound
        assert np.abs(filtered.filtered_covariance[t] - block(past_cov, t, n)).max() <= bound
        assert np.abs(smoothed.covariance[t] - block(cov, t, n)).max() <= bound
    assert filtered.log_likelihood == pytest.approx(joint.log_likelihood(y), rel=1e-9)
    assert np.array_equal(np.isnan(filtered.innovations), np.isnan(y))
    hidden = np.isnan(y)[:, :, None] | np.isnan(y)[:, None, :]
    assert np.array_equal(np.isnan(filtered.innovation_covariance), hidden)
    assert np.array_equal(np.isnan(filtered.gain), np.broadcast_to(np.isnan(y)[:, None, :], filtered.gain.shape))
    assert np.array_equal(filtered.predicted[4], filtered.filtered[4])


def test_a_series_with_nothing_in_it_and_forecasts():
    space = kalman(0.5, 1.0, 1.0, 1.0, 1.0, x0=2.0, measurements=[np.nan, np.nan])
    found = space.filter()
    assert found.predicted.ravel().tolist() == [2.0, 1.0] and found.log_likelihood == 0.0
    assert found.predicted_covariance.ravel() == pytest.approx([4 / 3, 4 / 3])
    ahead = kalman(0.5, 1.0, 1.0, 1.0, 1.0, P0=1.0, measurements=[1.0, np.nan, np.nan]).filter()
    assert ahead.filtered.ravel() == pytest.approx([0.5, 0.25, 0.125])


# ---------------------------------------------------------------------- against statsmodels


def statsmodels_results(arguments, y, smooth=True):
    from statsmodels.tsa.statespace.kalman_smoother import KalmanSmoother

    A, B, C, Q, R = (np.asarray(arguments[x]) for x in "ABCQR")
    n, m, p = A.shape[-1], C.shape[-2], Q.shape[-1]
    model = KalmanSmoother(k_endog=m, k_states=n, k_posdef=p)
    model.bind(np.asfortranarray(y.T))  # (k_endog, nobs)
    over = lambda x: np.moveaxis(np.concatenate([x, x[-1:]]) if len(x) == len(y) - 1 else x, 0, -1) if x.ndim == 3 else x
    model["transition"], model["selection"], model["design"] = over(A), over(B), over(C)
    model["state_cov"], model["obs_cov"] = over(Q), over(R)
    model.tolerance = 0  # its shortcut to the steady state is off by more than rounding
    model.initialize_known(arguments["x0"], arguments["P0"])
    return model.smooth() if smooth else model.filter()


@pytest.mark.parametrize("name", [n for n in SYSTEMS if n != "one step"])
@pytest.mark.parametrize("missing", [False, True], ids=["complete", "missing"])
def test_statsmodels_agrees(name, missing):
    arguments = system(**SYSTEMS[name])
    space = kalman(**arguments)
    y = space.sample(3)[1]
    if missing:
        y[1:, 0][::3] = np.nan
        y[-1] = np.nan
    theirs, filtered, smoothed = statsmodels_results(arguments, y), space.filter(y), space.smooth(y)
    joint = Joint(**arguments)
    close = dict(rtol=1e-8, atol=joint.tolerance(np.nan_to_num(y)))
    assert np.allclose(filtered.predicted, theirs.predicted_state.T[:-1], **close)
    assert np.allclose(filtered.predicted_covariance, np.moveaxis(theirs.predicted_state_cov, -1, 0)[:-1], **close)
    assert np.allclose(filtered.filtered, theirs.filtered_state.T, **close)
    assert np.allclose(filtered.filtered_covariance, np.moveaxis(theirs.filtered_state_cov, -1, 0), **close)
    assert np.allclose(smoothed.states, theirs.smoothed_state.T, **close)
    assert np.allclose(smoothed.covariance, np.moveaxis(theirs.smoothed_state_cov, -1, 0), **close)
    assert filtered.log_likelihood == pytest.approx(theirs.llf, rel=1e-9)
    if not missing:
        assert np.allclose(filtered.innovations, theirs.forecasts_error.T, **close)
        assert np.allclose(filtered.innovation_covariance, np.moveaxis(theirs.forecasts_error_cov, -1, 0), **close)


def test_a_long_series_costs_what_it_is_long():
    """2000 steps of a constant-velocity track: sweeps only, and what statsmodels finds."""
    h = 0.1
    arguments = dict(A=np.array([[1, h], [0, 1]]), B=np.array([[h * h / 2], [h]]), C=np.array([[1.0, 0]]), Q=np.eye(1) / 2, R=np.eye(1) / 5)
    arguments |= dict(x0=np.array([1.0, -1.0]), P0=np.eye(2), steps=2000)
    space = kalman(**arguments)
    y = space.sample(5)[1]
    theirs, found, smoothed = statsmodels_results(arguments, y), space.filter(y), space.smooth(y)
    assert np.allclose(found.filtered, theirs.filtered_state.T, rtol=1e-9, atol=1e-9)
    assert np.allclose(smoothed.states, theirs.smoothed_state.T, rtol=1e-9, atol=1e-9)
    assert np.allclose(smoothed.covariance, np.moveaxis(theirs.smoothed_state_cov, -1, 0), rtol=1e-8, atol=1e-10)
    assert found.log_likelihood == pytest.approx(theirs.llf, rel=1e-11)
    H, psi, K, D, P, I = space.soa("H psi K D P I")
    for e in (I - H @ psi @ K, psi @ K, P - P @ space.soa.Upsilon @ P, psi.T @ H.T @ D.inv() @ (I - H @ psi @ K), space.covariance.inv()):
        plan = e.plan()
        assert not plan.has_dense_step, e.text()
    flops = [kalman(**arguments | {"steps": n}).covariance.inv().plan().flops for n in (1000, 2000, 4000)]
    assert flops[2] - flops[1] == pytest.approx(2 * (flops[1] - flops[0]), rel=1e-6)  # a straight line


# ---------------------------------------------------------------------- models and what they refuse


def test_numbers_vectors_and_defaults():
    space = kalman(0.5, 1.0, 1.0, 0.75, 0.1, steps=3)
    assert space.P0.item() == pytest.approx(1.0) and space.x0.tolist() == [0.0]
    column = kalman(np.diag([0.5, 0.2]), [1.0, 0.0], [[1.0, 1.0]], 1.0, 1.0, steps=2)
    assert column._M[1].tolist() == [[1.0, 0.0], [0.0, 0.0]]
    assert np.array_equal(kalman(0.5, None, 1.0, 2.0, 1.0, steps=2)._M[1], [[2.0]])
    with_time = kalman(np.ones((3, 1, 1)), 1.0, 1.0, 1.0, 1.0, P0=1.0)
    assert with_time.steps == 4 and repr(with_time) == "<state space: 4 steps, states of 1, measurements of 1>"
    assert with_time.soa.E.dense()[2, 3] == 1.0 and with_time.soa._source.body_names == ["t3", "t2", "t1", "t0"]


def test_samples_have_the_covariance_of_the_model():
    space = kalman(**system(1, steps=3))
    draws = np.array([space.sample(seed)[1].ravel() for seed in range(4000)])
    backward = np.arange(6).reshape(-1, 2)[::-1].ravel()
    expected = space.covariance.dense()[np.ix_(backward, backward)]
    # a sample variance is off by √(2/4000) of it; five of those
    assert np.abs(np.cov(draws.T) - expected).max() <= 5 * np.sqrt(2 / 4000) * np.abs(expected).max()


def test_no_measurement_noise():
    exact = kalman(**system(1, m=1) | {"R": np.zeros((1, 1))})
    y = exact.sample(0)[1]
    found = exact.filter(y)
    assert np.abs(np.einsum("tij,tj->ti", exact._C, found.filtered) - y).max() <= 1e-10 * np.abs(y).max()  # what is measured is known
    twice = kalman(1.0, 1.0, [[1.0], [1.0]], 1.0, np.zeros((2, 2)), P0=1.0, measurements=[[1.0, 1.0], [2.0, 2.0]])
    for call in (twice.filter, twice.smooth, twice.log_likelihood):
        with pytest.raises(pc.SingularHingeError, match=r"innovation, D = CPC\* \+ R, is singular at step 0.*give it noise R"):
            call()
    known = kalman(1.0, 1.0, 1.0, 0.0, 0.0, P0=1.0, measurements=[1.0, 1.0, 1.0])
    with pytest.raises(pc.SingularHingeError, match="at step 1"):
        known.filter()


@pytest.mark.parametrize(
    "changed, words",
    [
        (dict(C=np.ones((2, 4))), r"C is \(2, 4\)"),
        (dict(Q=np.eye(3)), r"B is \(3, 2\)"),
        (dict(R=np.eye(3)), r"R is \(3, 3\)"),
        (dict(R=-np.eye(2)), "R is a covariance: it must be positive semidefinite, and has the eigenvalue -1"),
        (dict(Q=np.array([[1.0, 2.0], [0.0, 1.0]])), "Q is a covariance: it must be symmetric"),
        (dict(P0=np.eye(2)), r"P0 is \(3, 3\), not \(2, 2\)"),
        (dict(P0=np.diag([1.0, 1.0, -1.0])), "P0 is a covariance"),
        (dict(P0=None, A=2 * np.eye(3)), "P0 is needed"),
        (dict(x0=[1.0]), "x0 is 3 finite numbers"),
        (dict(A=np.full((3, 3), np.nan)), "A has entries that are not finite"),
        (dict(A=np.ones(3)), "A is a matrix"),
        (dict(steps=None), "how many steps"),
        (dict(steps=0), "at least one step"),
        (dict(measurements=np.zeros((5, 2))), "number of steps differs: steps= has 12, measurements has 5"),
        (dict(measurements=np.zeros((12, 3))), r"measurements are \(N, 2\)"),
        (dict(A=np.zeros((5, 3, 3))), "A has 5 matrices; between 12 steps there are 11"),
    ],
)
def test_what_does_not_fit_is_said(changed, words):
    with pytest.raises(pc.ModelError, match=words):
        kalman(**system(1) | changed)


@pytest.mark.parametrize("mechanism", [lambda: pc.chain(2), lambda: pc.chain(2).soa])
def test_a_mechanism_is_no_state_space_model(mechanism):
    """The error says what to write, and what it says runs."""
    with pytest.raises(pc.ModelError, match=r"matrices of a linear state-space model, such as .*\.play\(y, model=arm\)") as refused:
        kalman(mechanism())
    example = re.search(r"pc\.kalman\(.*?steps=8\)", str(refused.value)).group()
    assert eval(example, {"pc": pc, "np": np}).steps == 8


def test_what_is_left_out_is_the_identity_but_for_noises():
    given = dict(A=[[0.9, 0.1], [0, 0.8]], Q=np.eye(2), R=0.5 * np.eye(2), steps=4)
    y = np.arange(8.0).reshape(4, 2)
    np.testing.assert_array_equal(kalman(**given).filter(y).filtered, kalman(**given, B=np.eye(2), C=np.eye(2)).filter(y).filtered)
    with pytest.raises(pc.ModelError, match="give Q, the covariance of the process noise and R, the covariance of the measurement noise"):
        kalman(0.9)
    with pytest.raises(pc.ModelError, match="give R, the covariance of the measurement noise, such as"):
        kalman(0.9, Q=1.0)


def test_measurements_that_do_not_fit():
    space = kalman(**system(1))
    with pytest.raises(pc.ModelError, match="no measurements"):
        space.filter()
    with pytest.raises(pc.ModelError, match="the model has 12 steps, the measurements 3"):
        space.filter(np.zeros((3, 2)))
    with pytest.raises(pc.ModelError, match="finite numbers"):
        space.filter(np.full((12, 2), np.inf))


def test_the_dictionary_shows():
    book = kalman(0.5, 1.0, 1.0, 1.0, 1.0, steps=2).dictionary
    text = str(book)
    assert isinstance(book, Dictionary) and "\\" not in text and "$" not in text
    assert "P   " in text and "covariance of the predicted state, P(t|t-1) (n, n)" in text and "φMφ* = R + φ̃R + Rφ̃*" in text
    html, latex = book._repr_html_(), book.latex()
    assert html.count("<tr>") == len(book.rows) + 1 and r"\(\mathcal{G}\)" in html and "$" not in html
    assert latex.startswith(r"\begin{tabular}{ll}") and latex.count(r"\\") == len(book.rows) + 1 and latex.isascii()
    names = {row["name"] for row in book.rows}
    assert {"E", "H", "M", "J", "P", "D", "G", "K", "psi", "Upsilon"} <= names
