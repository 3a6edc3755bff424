"""A robot with sets of bodies taken as one node, in one tree with rigid single bodies: against the robot itself, whose ℳ, accelerations
and derivatives are the same, and against NumPy from the definitions."""

import copy
import pickle

import numpy as np
import pytest

import pycraft as pc

EPS = np.finfo(float).eps

# parents, hinges, groups. Among them: groups at the root, at tips, within chains, side by side, of branches; single bodies above and below
# groups; coordinates of a group that do not follow each other; hinges of many and of no coordinates; all bodies in one; none grouped.
TREES = {
    "chain, middle": ([-1, 0, 1, 2, 3], ["pin"] * 5, [[1, 2]]),
    "chain, root": ([-1, 0, 1, 2], ["pin", "ball", "pin", "slider"], [[0, 1]]),
    "chain, tip": ([-1, 0, 1, 2], ["pin", "universal", "pin", "pin"], [[2, 3]]),
    "chain, two": ([-1, 0, 1, 2, 3, 4], ["pin", "slider", "ball", "pin", "pin", "universal"], [[0, 1], [3, 4, 5]]),
    "free root": ([-1, 0, 0, 1, 1], ["free", "pin", "ball", "universal", "slider"], [[0, 2]]),
    "branches": ([-1, 0, 1, 0, 3, 0, 5], ["free", "pin", "pin", "pin", "ball", "screw", "pin"], [[0, 1, 3], [5, 6]]),
    "coordinates apart": ([-1, 0, 1, 0, 3, 0], ["universal", "pin", "ball", "pin", "pin", "slider"], [[0, 3, 5], [1, 2]]),
    "fork within": ([-1, 0, 1, 1, 2, 3], ["pin", "pin", "ball", "pin", "pin", "universal"], [[1, 2, 3]]),
    "several roots": ([-1, 0, -1, 2, 3], ["pin", "pin", "free", "pin", "planar"], [[2, 3]]),
    "all": ([-1, 0, 1, 0], ["pin", "ball", "pin", "slider"], [[0, 1, 2, 3]]),
    "none": ([-1, 0, 0], ["pin", "ball", "pin"], []),
    "one body": ([-1], ["ball"], [[0]]),
}
LETTERS = "E phi phi_tilde H M J P P_plus D G K tau tau_bar E_psi psi psi_tilde R Upsilon Omega".split()


def grouped(name, rotors, seed=4):
    parents, hinges, groups = TREES[name]
    robot = pc.tree(parents, hinges, seed=seed, rotor_inertia=rotors)
    robot.q, robot.v = robot.random_state(seed).q, robot.random_state(seed).v
    return robot, robot.soa.grouped([[f"body{k}" for k in group] for group in groups])


@pytest.fixture(scope="module", params=[(n, r) for n in TREES for r in (False, True)], ids=lambda p: f"{p[0]}{', rotors' if p[1] else ''}")
def case(request):
    return grouped(*request.param)


def near(found, expected, size=1e3):
    """To `size` roundings of the largest entry: products of a few dozen terms, through inverses of conditions of a hundred."""
    found, expected = np.asarray(found, float), np.asarray(expected, float)
    assert found.shape == expected.shape
    assert np.abs(found - expected).max(initial=0) <= size * EPS * max(1.0, np.abs(expected).max(initial=0))


def by_definition(soa):
    """The letters of a tree from its blocks E, H, M, J alone."""
    parents, own = soa._source.parents, {n: getattr(soa, n).dense() for n in ("E", "H", "M", "J")}
    E, H, M, J = own.values()
    rows = [s for _, s, _ in soa.V.blocks]
    columns = [[i for _, b, g in soa.Theta.blocks if g == k for i in range(b.start, b.stop)] for k in range(len(rows))]
    eye = np.eye(len(M))
    P, Pp, R, D, G, Y = M.copy(), np.zeros_like(M), M.copy(), np.zeros_like(J), np.zeros_like(H.T), np.zeros_like(M)
    for k in reversed(range(len(rows))):
        b, c = rows[k], columns[k]
        h = H[np.ix_(c, np.arange(b.start, b.stop))]
        D[np.ix_(c, c)] = h @ P[b, b] @ h.T + J[np.ix_(c, c)]
        G[b, c] = P[b, b] @ h.T @ np.linalg.inv(D[np.ix_(c, c)])
        Pp[b, b] = P[b, b] - G[b, c] @ h @ P[b, b]
        if parents[k] >= 0:
            p = rows[parents[k]]
            P[p, p] += E[p, b] @ Pp[b, b] @ E[p, b].T
            R[p, p] += E[p, b] @ R[b, b] @ E[p, b].T
    phi, tau = np.linalg.inv(eye - E), G @ H
    E_psi = E @ (eye - tau)
    psi, Dinv = np.linalg.inv(eye - E_psi), np.linalg.inv(D) if len(D) else D
    Omega = psi.T @ H.T @ Dinv @ H @ psi
    for b in rows:
        Y[b, b] = Omega[b, b]
    return own | dict(
        phi=phi, phi_tilde=phi - eye, P=P, P_plus=Pp, D=D, G=G, K=E @ G, tau=tau, tau_bar=eye - tau, E_psi=E_psi,
        psi=psi, psi_tilde=psi - eye,
        R=R, Upsilon=Y, Omega=Omega,
    )  # fmt: skip


def test_every_letter_by_definition(case):
    _, soa = case
    known, rng = by_definition(soa), np.random.default_rng(1)
    for name in LETTERS:
        op = getattr(soa, name)
        near(op.dense(), known[name])
        x, y = rng.normal(size=(op.shape[1], 3)), rng.normal(size=(op.shape[0], 2))
        near(op @ x, known[name] @ x)
        near(op.T @ y, known[name].T @ y)
    near(soa.D.inv().dense(), np.linalg.inv(known["D"]))
    near(pc.blockdiag(soa.phi @ soa.M @ soa.phi.T).dense(), known["R"])


def test_blocks_of_groups_by_the_robots(case):
    """φ_S, H_S: H = H_S φ_S, and Hφ is the robot's, row by row."""
    robot, soa = case
    own, groups = robot.soa, soa._source.groups
    order = np.concatenate([np.arange(6 * k, 6 * k + 6) for group in groups for k in group])
    near((soa.H_S @ soa.phi_S).dense(), soa.H.dense())
    near((soa.H @ soa.phi).dense(), (own.H @ own.phi).dense()[:, order])
    near((soa.phi_S @ soa.phi).dense(), own.phi.dense()[np.ix_(order, order)])
    near(soa.H_S.dense(), own.H.dense()[:, order])


def test_the_robots_mass_matrix_and_its_inverse(case):
    robot, soa = case
    own, rng = robot.soa, np.random.default_rng(2)
    near((soa.MM + soa.J).dense(), (own.MM + own.J).dense())
    near(float((soa.MM - own.MM).norm()), 0.0)  # one space Θ
    whole, mine = (own.MM + own.J).inv(), (soa.MM + soa.J).inv()
    near(mine.dense(), whole.dense())
    x = rng.normal(size=(robot.nv, 2))
    near(mine @ x, whole @ x)
    near(soa.MM @ x, own.MM @ x)
    near(float((soa.MM + soa.J).logdet()), float((own.MM + own.J).logdet()))
    near(float(soa.D.logdet()), float(own.D.logdet()))
    near(float(mine.trace()), float(whole.trace()))
    near(mine.diagonal(), whole.diagonal())
    near(
        (2 * soa.MM + soa.D @ soa.D).inv().dense(), np.linalg.inv(2 * own.MM.dense() + soa.D.dense() @ soa.D.dense()), 1e4
    )  # a realization


@pytest.mark.parametrize("form", ["fast", "ud", "square-root"])
@pytest.mark.parametrize("precision", ["single", "double", "extended", "quad", 50, 100])
def test_forms_and_precisions(form, precision):
    eps = {"single": 2.0**-23, "double": EPS, "extended": 2.0**-63, "quad": 2.0**-112, 50: 1e-49, 100: 1e-99}[precision]
    for name in ("chain, two", "branches", "coordinates apart", "several roots"):
        robot, soa = grouped(name, rotors=True)
        x = np.random.default_rng(3).normal(size=robot.nv)
        mine, whole = (np.asarray((s.MM + s.J).inv().at(form=form, precision=precision).dense(), object) for s in (soa, robot.soa))
        assert np.abs(mine - whole).max() <= 1e4 * eps * np.abs(whole).max()
        P, by_fast = soa.P.at(form=form, precision=precision).dense(), soa.P.at(precision=precision).dense()
        assert np.abs(P - by_fast).max() <= 1e4 * eps * np.abs(by_fast).max()
        near(
            np.asarray((soa.MM + soa.J).inv().at(form=form, precision=precision) @ x, float),
            whole.astype(float) @ x,
            1e4 * max(1, eps / EPS),
        )


@pytest.mark.parametrize("residual", ["same", "wider", "gather"])
def test_refined(residual):
    robot, soa = grouped("coordinates apart", rotors=False)
    x = np.random.default_rng(5).normal(size=robot.nv)
    exact = np.asarray(robot.soa.MM.inv().at(precision=50) @ x, float)
    near(soa.MM.inv().at(refine=2, residual=residual) @ x, exact, 64)


def test_batches_are_states_one_by_one(case):
    robot, soa = case
    Q = np.stack([robot.random_state(seed).q for seed in range(5)])
    X = np.random.default_rng(4).normal(size=(5, robot.nv))
    op = (soa.MM + soa.J).inv()
    values = op.at(Q) @ X
    for q, x, value in zip(Q, X, values, strict=True):
        assert np.array_equal(op.at(q) @ x, value)
    assert np.array_equal(soa.P.at(Q).dense()[3], soa.P.at(Q[3]).dense())


def test_derivatives(case):
    """Along coordinates, twice, along time, in world axes, along parameters: derivatives of ℳ, ℳ⁻¹, ln det equal the robot's."""
    robot, soa = case
    own, n = robot.soa, robot.nv
    pairs = [((s.MM + s.J), (s.MM + s.J).inv(), (s.MM + s.J).logdet()) for s in (soa, own)]
    rng = np.random.default_rng(6)
    for i in rng.permutation(n)[:4]:
        for mine, whole in zip(*pairs, strict=True):
            a, b = mine.diff(int(i)), whole.diff(int(i))
            near(*((float(a), float(b)) if isinstance(a, type(pairs[0][2])) else (a.dense(), b.dense())), 1e4)
    i, j = (int(k) for k in rng.integers(n, size=2))
    near(pairs[0][0].diff(i, j).dense(), pairs[1][0].diff(i, j).dense(), 1e4)
    near(pairs[0][0].dot().dense(), pairs[1][0].dot().dense(), 1e4)
    near(pairs[0][0].diff(i, frame="world").dense(), pairs[1][0].diff(i, frame="world").dense(), 1e4)
    body = robot.bodies[list(robot.bodies)[-1]]
    for parameter in (body.symbol("mass"), body.symbol("com", "x"), body.hinge.symbol("placement", "x")):
        near(pairs[0][0].diff(parameter).dense(), pairs[1][0].diff(parameter).dense(), 1e4)


LETTERS_MOVED = ("E", "H", "phi", "P", "D", "G", "psi", "Upsilon", "phi_S", "H_S", "X_world", "gravity_base", "gravity_field")


def test_derivatives_of_letters_by_differences(case):
    """Along every coordinate, against a central difference: its step of 1e-5 leaves 1e-10 of the third derivative, eps/1e-5 of rounding."""
    robot, soa = case
    robot.gravity = (0.3, -0.2, -9.0)
    step = 1e-5
    for i in range(robot.nv):
        e = np.eye(robot.nv)[i]
        ahead, behind = (robot.integrate(robot.q, sign * step * e) for sign in (1, -1))
        for name in LETTERS_MOVED:
            op = getattr(soa, name)
            expected = (op.at(ahead).dense() - op.at(behind).dense()) / (2 * step)
            assert np.abs(op.diff(i).dense() - expected).max(initial=0) <= 1e-7 * max(1.0, np.abs(op.dense()).max()), (name, i)


def test_motion_is_the_robots(case):
    """Vectors are stacked; φ*(H*θ̈ + a) and forces are the robot's."""
    robot, soa = case
    own, groups = robot.soa, soa._source.groups
    order = np.concatenate([np.arange(6 * k, 6 * k + 6) for group in groups for k in group])
    robot.gravity = (0.3, -0.2, -9.0)
    vdot = np.random.default_rng(7).normal(size=robot.nv)
    for name in ("velocity", "b", "gravity_field"):
        near(getattr(soa, name).value(), getattr(own, name).value()[order])
    near(soa.theta_dot.value(), own.theta_dot.value())
    near((soa.phi.T @ soa.H.T @ soa.theta_dot).value(), own.velocity.value()[order])
    both = []
    for s in (soa, own):
        acceleration = s.phi.T @ (s.H.T @ vdot + s.a.value() + s.gravity_base.value())
        both.append(acceleration)
        near(
            s.H @ (s.phi @ (s.M @ acceleration + s.b.value())) + s.J @ vdot + robot.rotor_forces(robot.v),
            robot.inverse_dynamics(robot.q, robot.v, vdot),
            1e4,
        )
    near(both[0], both[1][order], 1e4)
    for name in ("V_tilde", "V_bar", "momentum_cross", "X_world", "Delta_theta_dot"):
        near(getattr(soa, name).dense(), getattr(own, name).dense()[np.ix_(order, order)])


def test_along_time(case):
    """Against central differences along θ̇ with θ̈ as given."""
    robot, soa = case
    robot.gravity = (0.3, -0.2, -9.0)
    vdot, step = np.random.default_rng(7).normal(size=robot.nv), 1e-5
    for name in ("H", "P", "velocity", "a", "b", "gravity_base", "gravity_field", "V_bar", "H_dot", "phi_S", "H_S"):
        op = getattr(soa, name)
        ahead, behind = (op.at(robot.integrate(robot.q, s * robot.v), robot.v + s * vdot).dense() for s in (step, -step))
        assert np.abs(op.dot(vdot=vdot).dense() - (ahead - behind) / (2 * step)).max(initial=0) <= 1e-5 * max(
            1.0, np.abs(op.dense()).max()
        ), name


def test_nodes(case):
    robot, soa = case
    names = list(robot.bodies)
    if "tool" not in robot.nodes:
        robot.add_node("tool", names[-1], position=(0.1, 0.2, 0.3))
    soa = robot.soa.grouped([[names[k] for k in group] for group in soa._source.groups if len(group) > 1])
    nodes = ["tool", names[0], names[-1]]
    near(soa.Jacobian(nodes).dense(), robot.soa.Jacobian(nodes).dense())
    near((soa.B(nodes).T @ soa.Omega @ soa.B(nodes)).dense(), (robot.soa.B(nodes).T @ robot.soa.Omega @ robot.soa.B(nodes)).dense(), 1e4)


def test_the_catalogue(case):
    _, soa = case
    report = soa.check()
    assert report and len(report.findings) > 80 and not report.failed and not report.undecided, str(report)


@pytest.mark.parametrize("name", ["chain, middle", "branches", "coordinates apart", "free root"])
def test_written_out(name):
    """The recursion in Python, run, gives the numbers."""
    robot, soa = grouped(name, rotors=True)
    x = np.random.default_rng(8).normal(size=robot.nv)
    for op in ((soa.MM + soa.J).inv(), soa.MM, soa.D, soa.P):
        argument = x if op.shape[1] == robot.nv else np.random.default_rng(9).normal(size=op.shape[1])
        written = op.algorithm("python")
        names = {"__name__": "written"}
        exec(compile(written.python(), "written.py", "exec"), names)
        near(names["algorithm"](written.data(), argument), op @ argument, 1e4)


@pytest.mark.parametrize("name", ["branches", "coordinates apart"])
def test_written_out_velocities_and_derivatives(name):
    """Operators made body by body within groups are available; functions of vectors by body are refused."""
    robot, soa = grouped(name, rotors=True)
    for op in (soa.MM.diff(2), soa.a, soa.V_bar, soa.gravity_field, soa.Delta(1), soa.H.diff(1), soa.velocity):
        written, names = op.algorithm("python", "dense" if op.shape[1] > 1 else "apply"), {"__name__": "written"}
        exec(compile(written.python(), "written.py", "exec"), names)
        near(np.ravel(names["algorithm"](written.data())), np.ravel(op.dense()), 1e4)
    with pytest.raises(pc.EvaluationError, match="body by body within a group"):
        soa.V_bar.dot(vdot=np.zeros(robot.nv)).algorithm()


def test_kept_and_copied(case):
    _, soa = case
    for op in (soa.MM, soa.H_S @ soa.phi_S, soa.D + pc.constant(np.eye(soa.D.shape[0]), soa.Theta, soa.Theta, "C")):
        for again in (pickle.loads(pickle.dumps(op)), copy.deepcopy(op)):
            near(again.dense(), op.dense())
            assert again.is_block_diagonal == op.is_block_diagonal and again.sources[0].groups == soa._source.groups
    again = pickle.loads(pickle.dumps(soa))
    near(again.MM.dense(), soa.MM.dense())


def test_numbers_follow_the_model():
    robot, soa = grouped("branches", rotors=False)
    before = soa.MM.dense()
    robot.bodies[list(robot.bodies)[3]].mass = 7.0
    near(soa.MM.dense(), robot.soa.MM.dense())
    assert np.abs(soa.MM.dense() - before).max() > 0.1
    robot.q = robot.random_state(9).q
    near(soa.MM.dense(), robot.soa.MM.dense())
    robot.remove_body(list(robot.bodies)[-1])
    with pytest.raises(pc.StaleOperatorError):
        soa.MM.dense()


def test_other_groups_are_other_blocks():
    """Two ways of grouping share Θ; what has letters of both goes column by column, never block by block."""
    robot, one = grouped("chain, two", rotors=False)
    names = list(robot.bodies)
    other = robot.soa.grouped([names[1:3], names[3:5]])
    whole = one.D + other.D
    near(whole.dense(), one.D.dense() + other.D.dense())
    assert not whole.is_block_diagonal and one.D.is_block_diagonal and (one.D + one.J).is_block_diagonal
    near(whole.inv().dense(), np.linalg.inv(whole.dense()), 1e4)
    near(whole.diagonal(), np.diag(whole.dense()))
    near(float((one.D @ other.D).logdet()), float(one.D.logdet()) + float(other.D.logdet()))


@pytest.mark.parametrize(
    ("groups", "message"),
    [
        ([["body1", "body3"]], "do not hang together"),
        ([["body1", "body2"], ["body2", "body3"]], "named twice"),
        ([["body1", "nobody"]], "nobody"),
        (["body1"], "list of lists"),
        ("body1", "list of lists"),
        ([[]], "one body or more"),
        ([[1, 2]], "names of one body or more"),
    ],
)
def test_refusals(groups, message):
    with pytest.raises(pc.ModelError, match=message):
        pc.chain(5).soa.grouped(groups)


@pytest.mark.parametrize("form", ["fast", "ud", "square-root"])
@pytest.mark.parametrize("grouped", [[], [["below", "base"]], [["below", "thin"]]], ids=["alone", "on a group", "in a group"])
def test_a_hinge_that_feels_nothing_but_rounding_is_refused(grouped, form):
    """A point mass that turns about the line to its own centre, oblique: D would be noise."""
    robot, com = pc.Multibody("needle"), np.array([0.3, 0.4, 0.5])
    for name, parent in (("base", None), ("below", "base")):
        robot.add_body(name, parent, "pin", axis=(0, 1, 0), position=(0.3, 0.1, 0), mass=2.0, com=(0.1, 0.2, 0.3), inertia=np.eye(3))
    robot.add_body("thin", "below", "pin", axis=com, position=(0.1, 0.7, 0.2), mass=1.0, com=com)
    soa = robot.soa.grouped(grouped)
    with pytest.raises(pc.SingularHingeError, match="thin"):
        soa.MM.inv().at([0.3, -0.2, 0.5], form=form) @ np.ones(3)


@pytest.mark.filterwarnings("ignore::pycraft.ModelWarning")  # of the massless body
@pytest.mark.parametrize("form", ["fast", "ud", "square-root"])
def test_rounding_that_a_group_hands_on_is_no_inertia(form):
    """Point masses on a line through a massless body's hinge, in a group above it: the D of that hinge would be the group's rounding."""
    robot, line = pc.Multibody("spit", welds="keep"), np.array([0.3, 0.4, 0.7])
    robot.add_body("base", None, "pin", axis=(0, 1, 0), mass=2.0, com=(0.1, 0.2, 0.3), inertia=np.eye(3))
    robot.add_body("spit", "base", "pin", axis=line, position=(0.3, 0.1, 0))
    robot.add_body("near", "spit", "weld", position=0.37 * line, mass=1.3, com=0.11 * line)
    robot.add_body("far", "near", "weld", position=0.53 * line, mass=0.7, com=0.17 * line)
    soa = robot.soa.grouped([["near", "far"]])
    with pytest.raises(pc.SingularHingeError, match="spit"):
        soa.MM.inv().at([0.3, -0.2], form=form) @ np.ones(2)


def test_of_a_robot_only():
    robot = pc.chain(3)
    soa = robot.soa.grouped([list(robot.bodies)[:2]])
    with pytest.raises(pc.ModelError, match="not a complete multibody model"):
        soa.grouped([])
