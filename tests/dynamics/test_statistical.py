"""Equipartition draws and the Fixman potential: covariances, energies by coordinate and body, the four-atom chain in closed form."""

import numpy as np
import pytest

import pycraft as pc
from support.differences import difference
from support.mechanisms import every_kind, four_atoms
from support.oracle import agree

DRAWS = 20000
SIGMAS = 5  # of a mean of so many draws: one test in a million fails by chance, and seeds are fixed


def models():
    rotors = pc.tree([-1, 0, 1, 1], ["pin", "ball", "slider", "pin"], seed=3)
    rotors.hinges["hinge3"].rotor_inertia = 0.7
    return {
        "chain": pc.chain(4),
        "tree": rotors,
        "free": pc.tree([-1, 0, 0], ["free", "pin", "universal"], seed=2),
        "every kind": every_kind(),
    }


@pytest.mark.parametrize("name", models())
def test_covariances_are_those_of_the_inverse_mass_matrix(name):
    model, kT = models()[name], 1.7
    state = model.random_state(1)
    v = model.equipartition(state.q, kT, count=DRAWS, rng=7)
    assert v.shape == (DRAWS, model.nv)
    factor = np.linalg.cholesky(model.mass_matrix(state.q))
    n = v @ factor / np.sqrt(kT)  # unit normal numbers, if the draws are what they should be
    assert np.abs(n.mean(axis=0)).max() < SIGMAS / np.sqrt(DRAWS)
    spread = n.T @ n / DRAWS - np.eye(model.nv)
    assert np.abs(spread).max() < SIGMAS * np.sqrt(2 / DRAWS)
    fourth = (n**4).mean(axis=0)
    assert np.abs(fourth - 3).max() < SIGMAS * np.sqrt(96 / DRAWS)


def test_every_innovation_and_every_body_has_its_share():
    """½ kT each of ξ*Dξ; the mean kinetic energy of a body is kT/2 tr(M Ω) by blocks."""
    model, kT = pc.tree([-1, 0, 1, 0], ["pin", "ball", "pin", "slider"], seed=5), 0.8
    state = model.random_state(2)
    v = model.equipartition(state.q, kT, count=DRAWS, rng=3)
    H, phi, K, D, M, Omega = model.soa("H phi K D M Omega")
    eta = np.asarray((D.sqrt().T @ (model.soa.I + H @ phi @ K).T).at(state.q) @ v.T)
    assert np.abs((eta**2).mean(axis=1) - kT).max() < SIGMAS * kT * np.sqrt(2 / DRAWS)
    V = np.asarray((phi.T @ H.T).at(state.q) @ v.T).reshape(model.nv and 4, 6, DRAWS)
    masses, compliance = M.at(state.q).dense(), Omega.at(state.q).dense()
    for k in range(4):
        own = slice(6 * k, 6 * k + 6)
        energy = 0.5 * np.einsum("id,ij,jd->d", V[k], masses[own, own], V[k])
        assert abs(energy.mean() - 0.5 * kT * np.trace(masses[own, own] @ compliance[own, own])) < SIGMAS * energy.std() / np.sqrt(DRAWS)


def test_draws_of_one_state_and_of_a_batch():
    model = models()["tree"]
    Q = np.array([model.random_state(seed).q for seed in range(3)])
    one, again = (model.equipartition(Q[0], 2.0, rng=4) for _ in range(2))
    assert one.shape == (model.nv,) and np.array_equal(one, again)
    assert not np.array_equal(one, model.equipartition(Q[0], 2.0, rng=5))
    batch = model.equipartition(Q, 2.0, rng=4)
    assert batch.shape == Q[:, :0].shape[:1] + (model.nv,)
    n = np.random.default_rng(4).standard_normal((3, model.nv))
    H, K, psi, D, I = model.soa("H K psi D I")
    for b in range(3):
        agree(batch[b], np.sqrt(2.0) * ((I - H @ psi @ K).T @ D.sqrt().inv().T).at(Q[b]) @ n[b])
    agree(model.equipartition(Q[0], 2.0, rng=4, boltzmann=0.25), one / 2)
    assert not model.equipartition(Q[0], 0.0).any() and model.equipartition(Q[0], count=0).shape == (0, model.nv)
    assert pc.Multibody("nothing").equipartition(count=3).shape == (3, 0)


@pytest.mark.parametrize("torsion", [0.0, 0.4, 1.3, 2.0, np.pi])
def test_four_atoms_in_closed_form(torsion):
    """Unit masses and bonds, right angles, the torsion free: det ℳ = 70 - 8c - 32c² + 2c⁴, c its cosine, 0 = cis."""
    model, kT = four_atoms(), 0.6
    q = np.concatenate([model.zero_q()[:7], [torsion]])
    c, s = np.cos(torsion), np.sin(torsion)
    det, slope = 70 - 8 * c - 32 * c**2 + 2 * c**4, s * (8 + 64 * c - 8 * c**3)
    agree(model.fixman_potential(q, kT), 0.5 * kT * np.log(det), 1e-12)
    agree(model.fixman_torque(q, kT)[-1], -0.5 * kT * slope / det, 1e-12)
    agree(model.fixman_torque(q, kT)[:6], np.zeros(6), 1e-12)  # where the whole is does not matter


def test_the_torque_is_that_of_the_potential():
    for model in models().values():
        state = model.random_state(6)
        torque = model.fixman_torque(state.q, 1.3)
        for i, e in enumerate(np.eye(model.nv)):
            moved = lambda h, e=e, model=model, q=state.q: model.fixman_potential(model.integrate(q, h * e), 1.3, precision="quad")
            agree(torque[i], -difference(moved), 1e-9)
    model = models()["tree"]
    Q = np.array([model.random_state(seed).q for seed in range(3)])
    agree(model.fixman_potential(Q, 2.0), [model.fixman_potential(q, 2.0) for q in Q])
    agree(model.fixman_torque(Q, 2.0), [model.fixman_torque(q, 2.0) for q in Q])


def test_refusals():
    model = pc.chain(2)
    with pytest.raises(pc.EvaluationError, match="temperature=-1: it is a finite number, not negative"):
        model.equipartition([0, 0], -1.0)
    with pytest.raises(pc.EvaluationError, match="boltzmann=inf"):
        model.fixman_torque([0, 0], boltzmann=np.inf)
    with pytest.raises(pc.EvaluationError, match="count needs one state"):
        model.equipartition([[0, 0]], count=3)
    with pytest.raises(pc.EvaluationError, match="count=-1: the number of draws"):
        model.equipartition([0, 0], count=-1)
    with pytest.raises(pc.ModelError, match="takes 2 numbers"):
        model.equipartition([0, 0, 0])
    for q in ("bent", {}, [1j, 0]):
        with pytest.raises(pc.ModelError, match="q is "):
            model.equipartition(q)
    with pytest.raises(pc.ModelError, match="seed must be a whole number, not 'dice'"):
        model.equipartition([0, 0], rng="dice")
    for call in (model.equipartition, model.fixman_potential, model.fixman_torque):
        with pytest.raises(pc.EvaluationError, match=r"temperature=1e\+200 by boltzmann=1e\+200 is inf J: take other units"):
            call([0, 0], 1e200, boltzmann=1e200)
    massless = pc.chain(2)
    massless.bodies["body1"].mass, massless.bodies["body1"].inertia = 0.0, np.zeros((3, 3))
    massless.take_warnings()
    with pytest.raises(pc.Error, match="hinge1|body1"):
        massless.equipartition([0.1, 0.2])
