"""States that packs evaluate singly: without a value, pivots that others would choose; models that changed, memory, threads."""

import threading

import numpy as np
import pytest

import pycraft as pc
from support.mechanisms import build, massless_inner_bodies, uniform_batch
from support.packs import NEVER, in_packs, one_by_one, packed, packs_from

STATES = 60


def arm():
    return pc.tree([-1, 0, 1, 1], ["screw", "ball", "pin", "slider"], seed=3)


def refusal(ask):
    """Return the message and the class of the error of an evaluation that must be refused."""
    with pytest.raises(pc.Error) as error:
        ask()
    return type(error.value), str(error.value)


# ---------------------------------------------------------------------- states without a value
def without_value(model, Q, at):
    """Expressions that have none at the states of Q[at], by how they lose it: eliminated, block by block, out of range."""
    MM, D, I = model.soa("MM D I")
    here, other = (model.random_state(seed).q for seed in (900, 901))
    for i in at:
        Q[i] = here
    of_root = [D.at(q).dense()[0, 0] for q in (here, other)]
    blocks = D - D.at(other) + float(of_root[1] - of_root[0]) * I
    shifted = MM - float(np.linalg.eigvalsh(model.mass_matrix(here))[2]) * I
    return {
        "eliminated": shifted.inv(),
        "a difference": (MM - MM.at(here)).inv(),
        "blocks": blocks.inv(),
        "a pivot": shifted.logdet(),
        "sweeps": MM @ blocks.inv() @ MM,
    }


@pytest.mark.parametrize("name", ["eliminated", "a difference", "blocks", "a pivot", "sweeps"])
@pytest.mark.parametrize("at", [[31], [0], [59], [40, 7, 52], list(range(60))], ids=str)
def test_states_without_a_value_refuse_as_by_themselves(name, at):
    """The same error, which names the first of them, whatever stands beside it."""
    model = arm()
    Q, V = uniform_batch(model, STATES, 70)
    e = without_value(model, Q, at)[name]
    for threads in (1, 3):
        bound = e.at(Q, V, threads=threads)
        ask = bound.value if name == "a pivot" else lambda: bound @ np.ones(model.nv)  # noqa: B023 - called at once
        singly = refusal(lambda: one_by_one(ask))  # noqa: B023 - called at once
        assert singly[0] is pc.SingularOperatorError
        assert f"(state {min(at)} of a batch of {STATES})" in singly[1]
        assert refusal(lambda: in_packs(ask)) == singly  # noqa: B023 - called at once


def test_numbers_out_of_range_refuse_as_by_themselves():
    """A pin that carries a slider: far out, ℳ is beyond the range of its numbers."""
    model = pc.tree([-1, 0], ["pin", "slider"], seed=4)
    Q = np.zeros((STATES, 2))
    MM = model.soa.H @ model.soa.phi @ model.soa.M @ model.soa.phi.T @ model.soa.H.T
    wanted = one_by_one(lambda: MM.at(Q) @ np.ones(2))
    for wrong in ([33, 34], [59], [0, 50]):
        R = Q.copy()
        R[wrong, 1] = 1e200
        for threads in (1, 4):
            ask = lambda: MM.at(R, threads=threads) @ np.ones(2)  # noqa: B023, E731 - called at once
            singly = refusal(lambda: one_by_one(ask))  # noqa: B023 - called at once
            assert f"(state {min(wrong)} of a batch of {STATES})" in singly[1] and "beyond the range" in singly[1]
            assert refusal(lambda: in_packs(ask)) == singly  # noqa: B023 - called at once
        np.testing.assert_array_equal(in_packs(lambda: MM.at(Q) @ np.ones(2)), wanted)  # a refusal leaves nothing behind


def test_hinges_that_are_singular_at_some_states():
    """A shoulder of three pins on massless bodies: where two axes meet, D has no inverse."""
    model = build(massless_inner_bodies())
    Q, V = uniform_batch(model, STATES)
    e = model.soa.MM.inv()
    np.testing.assert_array_equal(in_packs(lambda: e.at(Q, V) @ np.ones(model.nv)), one_by_one(lambda: e.at(Q, V) @ np.ones(model.nv)))
    none = pc.tree([-1, 0], ["pin", "pin"], seed=1)
    for body in none.bodies.values():
        body.mass, body.com, body.inertia = 0.0, (0, 0, 0), np.zeros((3, 3))
    Q, V = uniform_batch(none, 9)
    ask = lambda: none.soa.MM.inv().at(Q, V) @ np.ones(2)  # noqa: E731 - called at once
    assert refusal(lambda: in_packs(ask)) == refusal(lambda: one_by_one(ask))


# ---------------------------------------------------------------------- states that would be eliminated otherwise
def test_states_near_singular_ones_run_by_themselves():
    """Where what is eliminated once for all states loses digits, a state has the bits that it has by itself."""
    model = arm()
    Q, V = uniform_batch(model, STATES, 70)
    here, near = model.random_state(900).q, [5, 17, 58]
    along = np.random.default_rng(2).normal(size=(len(near), model.nv))
    for i, direction, step in zip(near, along, (1e-6, 1e-7, 1e-8), strict=True):
        Q[i] = model.integrate(here, step * direction)
    e = (model.soa.MM - float(np.linalg.eigvalsh(model.mass_matrix(here))[2]) * model.soa.I).inv()
    bound = e.at(Q, V)
    together, singly = in_packs(lambda: bound @ np.ones(model.nv)), one_by_one(lambda: bound @ np.ones(model.nv))
    in_packs(lambda: bound @ np.ones(model.nv))
    assert packed(bound).endswith("3 of them by themselves")
    np.testing.assert_array_equal(together[near], singly[near])
    for threads in (2, 5):
        np.testing.assert_array_equal(in_packs(lambda: e.at(Q, V, threads=threads) @ np.ones(model.nv)), together)  # noqa: B023 - called at once


def test_orders_of_pivots_that_states_disagree_about():
    """Turned by a right angle, the large entries of a block stand elsewhere: each state is solved to its condition all the same."""
    model = pc.chain(3, seed=1)
    Q, V = uniform_batch(model, STATES)
    skew = np.array([[0.0, 50.0, -20.0], [-50.0, 0.0, 30.0], [20.0, -30.0, 0.0]])
    e = (model.soa.MM + pc.constant(skew, model.soa.Theta, model.soa.Theta)).inv()
    found = in_packs(lambda: e.at(Q, V) @ np.ones(3))
    exact = np.asarray(e.at(Q, V, precision="quad") @ np.ones(3), float)
    condition = max(np.linalg.cond(model.mass_matrix(q) + skew) for q in Q)
    assert np.abs(found - exact).max() <= 100 * condition * np.finfo(float).eps * np.abs(exact).max()


# ---------------------------------------------------------------------- models that changed
def test_bodies_that_come_and_go():
    """Expressions bound to a model of another structure are refused, as by its states; the next operators are recorded again."""
    model = pc.chain(3, seed=1)
    for turn in range(3):
        Q, V = uniform_batch(model, 9)
        bound = model.soa.MM.inv().at(Q, V)
        ask = lambda: bound @ np.ones(model.nv)  # noqa: B023, E731 - called at once
        np.testing.assert_array_equal(in_packs(ask), one_by_one(ask))
        assert in_packs(ask).shape == (9, model.nv)
        if turn < 2:
            model.add_body(f"more{turn}", list(model.bodies)[-1], mass=1.0, com=(0.1, 0, 0), inertia=np.eye(3) / 10, position=(0.3, 0, 0))
        else:
            model.remove_body(list(model.bodies)[-1])
        x = np.ones(Q.shape[1])
        assert refusal(lambda: in_packs(lambda: bound @ x)) == refusal(lambda: one_by_one(lambda: bound @ x))  # noqa: B023 - called at once


def test_an_edit_between_two_batches_of_one_binding():
    """The binding stays, the program of the old numbers does not; and it serves again when they come back."""
    model = pc.robots.panda()
    Q, V = uniform_batch(model, 20)
    bound, link = (model.soa.MM + 0.1 * model.soa.I).inv().at(Q, V), list(model.bodies)[3]
    found = []
    for mass in (1.0, 2.0, 1.0, 2.0):
        model.bodies[link].mass = mass
        found.append(in_packs(lambda: bound @ np.ones(7)))
        assert packed(bound)
        np.testing.assert_allclose(found[-1], one_by_one(lambda: bound @ np.ones(7)), rtol=1e-11)
    assert np.abs(found[0] - found[1]).max() > 1e-3 * np.abs(found[0]).max()
    np.testing.assert_array_equal(found[0], found[2])
    np.testing.assert_array_equal(found[1], found[3])


# ---------------------------------------------------------------------- memory
def resident():
    with open("/proc/self/statm") as of_process:
        return int(of_process.read().split()[1]) * 4096


def test_what_is_too_long_runs_state_after_state():
    model = pc.chain(400, seed=1)
    Q, V = uniform_batch(model, 2)
    bound = model.soa.MM.inv().at(Q, V)
    together = in_packs(bound.dense)
    assert not packed(bound, "dense")
    np.testing.assert_array_equal(together, one_by_one(bound.dense))


@pytest.mark.skipif(not pc._core.__file__.endswith("linux-gnu.so"), reason="reads what the process holds from /proc")
def test_programs_are_few():
    """The programs of an expression for the last four models and kinds of request are kept: a hundred edits take the memory of some."""
    model = pc.chain(40, seed=1)
    Q, V = uniform_batch(model, 2)
    bound, link = model.soa.MM.inv().at(Q, V), list(model.bodies)[3]

    def edits(times):
        for i in range(times):
            model.bodies[link].mass = 1.0 + 0.01 * i
            in_packs(bound.dense)
            assert packed(bound, "dense")
        return resident()

    before = edits(12)
    instructions = int(packed(bound, "dense").split(" states, ")[1].split()[0])
    assert edits(60) - before < 20 * 16 * instructions  # of 60 at four words or more an instruction, a third


# ---------------------------------------------------------------------- threads
def test_threads_of_the_caller():
    """Runs of one expression from several threads at once, of batches of their own, while states of the model are set."""
    model = pc.robots.panda()
    soa = model.soa
    expressions = [soa.MM.inv(), (soa.MM + 0.1 * soa.I).inv(), soa.MM.diff(3), soa.H @ soa.psi]
    batches = [uniform_batch(model, 70 + i, 100 * i) for i in range(4)]
    wanted = [[np.asarray(e.at(Q, V).dense()) for e in expressions] for Q, V in batches]
    again = [soa.MM.inv(), (soa.MM + 0.1 * soa.I).inv(), soa.MM.diff(3), soa.H @ soa.psi]  # nothing recorded yet
    wrong, start = [], threading.Barrier(len(batches))

    def work(i):
        start.wait()
        for turn in range(12):
            k = (turn + i) % len(again)
            found = again[k].at(*batches[i], threads=1 + turn % 3).dense()
            if not np.array_equal(found, wanted[i][k]):
                wrong.append((i, turn, k))

    threads = [threading.Thread(target=work, args=(i,)) for i in range(len(batches))]
    for thread in threads:
        thread.start()
    for seed in range(50):
        model.q = model.random_state(seed).q
    for thread in threads:
        thread.join()
    assert not wrong


# ---------------------------------------------------------------------- what a run says
def test_passes_are_counted():
    """A pack executes for every state what its recording did."""
    model = pc.robots.panda()
    Q, V = uniform_batch(model, 24)
    for e in (model.soa.MM.inv(), (model.soa.MM + 0.1 * model.soa.I).inv(), model.soa.psi.T @ model.soa.phi.T):
        counts = []
        for states in (1, NEVER):
            with packs_from(states):
                bound = e.at(Q, V)
                bound @ np.ones(e.shape[1])
                passes = bound.plan().passes
                counts.append([getattr(passes, name) for name in ("values", "gathers", "scatters", "kernels", "eliminations", "dense")])
        assert counts[0] == counts[1]


def test_it_is_said():
    model = pc.robots.panda()
    Q, V = uniform_batch(model, 24)
    bound = model.soa.MM.inv().at(Q, V)
    in_packs(lambda: bound @ np.ones(7))
    assert "in the last run: packs: 24 states, " in str(bound.explain())
    one_by_one(lambda: bound @ np.ones(7))
    assert "packs" not in str(bound.explain())


def test_it_pays():
    """Long batches are recorded without being told to, short ones are not."""
    model = pc.robots.panda()
    (Q, V), e = uniform_batch(model, 4000), model.soa.MM.inv()
    e.at(Q[:3], V[:3]) @ np.ones(7)
    assert not packed(e.at(Q[:3], V[:3]))
    bound = e.at(Q, V)
    bound @ np.ones(7)
    assert packed(bound)
    short = e.at(Q[:8], V[:8])
    short @ np.ones(7)
    assert packed(short).startswith("packs: 8 states")
    eliminated = (model.soa.MM + 0.1 * model.soa.I).inv()
    for count, expected in ((63, False), (64, True), (63, False)):
        bound = eliminated.at(Q[:count], V[:count])
        bound @ np.ones(7)
        assert bool(packed(bound)) == expected
