"""Refusals of operators, each by its text: wrong products, numbers and arrays beside operators, two models, sizes; and
equality, hash, transposition and spaces."""

import warnings

import numpy as np
import pytest

import pycraft as pc
from support.mechanisms import every_kind


@pytest.fixture(scope="module")
def model():
    made = every_kind()
    made.add_node("tip", "body10", position=(0.1, 0.2, 0.3))
    return made


def mass_matrix(model):
    H, phi, M = model.soa("H phi M")
    return H @ phi @ M @ phi.T @ H.T


# ---------------------------------------------------------------------- products and sums that make no sense


def test_spaces_that_do_not_meet(model):
    H, phi, M, P, G, Omega = model.soa("H phi M P G Omega")
    n, f = len(model.soa.Theta), len(model.soa.F)
    for text, make in [
        (rf"H maps F \({f}\) to Θ \({n}\); it cannot follow H, which ends in Θ \({n}\)\.$", lambda: H @ H),
        (rf"M maps V \({f}\) to F \({f}\); it cannot follow φ, which ends in F", lambda: M * phi),
        ("φ maps F .*; it cannot follow φ\\*, which ends in V", lambda: phi @ phi.T),
        ("H maps F .*; M maps V .*: they cannot be added", lambda: H + M),
        ("they cannot be added", lambda: P - Omega),
        ("they cannot be added", lambda: phi + phi.T),
        ("H maps F .*: it is not square and has no inverse", lambda: H.inv()),
        ("only a map of a space to itself has powers", lambda: M**2),
        ("sqrt.*symmetric block-diagonal operator", lambda: phi.sqrt()),
        ("sqrt.*symmetric block-diagonal operator", lambda: (model.soa.tau).sqrt()),
        ("operator / operator: multiply by inv\\(\\)", lambda: M / P),
        (
            "R\\^2 and Θ .* are not cut into the same bodies",
            lambda: pc.blockdiag(pc.constant(np.ones((n, 2)), 2, model.soa.Theta)),
        ),
    ]:
        with pytest.raises(pc.SpaceError, match=text):
            make()
        with pytest.raises(TypeError):
            make()


def test_numbers_and_arrays_beside_operators(model):
    MM = mass_matrix(model)
    n = len(model.soa.Theta)
    x, X = np.ones(n), np.ones((n, n))
    for text, make in [
        ("number \\+ operator: a number is no operator; write 1\\*I", lambda: 1 + MM),
        ("write 2.5\\*I", lambda: MM - 2.5),
        ("write 3", lambda: 3 - MM),
        ("number \\+ operator", lambda: np.float64(1) + MM),
        ("array \\+ operator: an array has no spaces; make it an operator with pycraft.constant", lambda: X + MM),
        ("array \\+ operator", lambda: MM + X),
        ("array \\+ operator", lambda: x - MM),
        ("array \\+ operator", lambda: MM - list(x)),
        ("operator \\* array: `\\*` multiplies operators; apply an operator to an array with `@`", lambda: MM * x),
        ("array \\* operator: multiply an array and an operator with `@`", lambda: X * MM),
        ("unsupported operand", lambda: MM @ 2),
        ("unsupported operand", lambda: 2 @ MM),
        ("unsupported operand", lambda: 2 / MM),
        ("unsupported operand", lambda: MM @ None),
        ("unsupported operand", lambda: MM + None),
        ("unsupported operand", lambda: MM * 1j),
        ("unsupported operand", lambda: MM + "1"),
        ("whole number", lambda: MM**0.5),
        ("numbers", lambda: MM @ ["a"] * n),
    ]:
        with pytest.raises(TypeError, match=text):
            make()
    with pytest.raises(ZeroDivisionError):
        MM / 0
    with pytest.raises(TypeError):
        np.add(MM, X)  # no object arrays by way of NumPy
    with pytest.raises(TypeError):
        np.matmul(X, MM)


def test_wrong_shapes(model):
    MM = mass_matrix(model)
    n = len(model.soa.Theta)
    for shape, shown in [
        ((n + 1,), f"\\({n + 1},\\)"),
        ((n - 1, 2), f"\\({n - 1}, 2\\)"),
        ((2, n), f"\\(2, {n}\\)"),
        ((2, n, 1), f"\\(2, {n}, 1\\)"),
        ((), "\\(\\)"),
    ]:
        with pytest.raises(pc.EvaluationError, match=rf"it takes an array of shape \({n},\) or \({n}, m\), not {shown}"):
            MM @ np.ones(shape)
        with pytest.raises(ValueError):
            MM @ np.ones(shape)
    with pytest.raises(ValueError):
        np.ones((n, 2)) @ MM


def test_complex_numbers_are_refused(model):
    MM = mass_matrix(model)
    z = np.ones(len(model.soa.Theta)) * (1 + 1j)
    for make in (
        lambda: MM @ z,
        lambda: z @ MM,
        lambda: MM @ list(z),
        lambda: 1j * MM,
        lambda: MM / 1j,
        lambda: pc.constant(np.diag(z), model.soa.Theta, model.soa.Theta),
    ):
        with pytest.raises(TypeError):
            make()
    with pytest.raises(TypeError, match="apply them to the real and imaginary parts"):
        MM @ z


@pytest.mark.parametrize("make", [lambda c, A: c * A, lambda c, A: A * c, lambda c, A: A / c], ids=["c*A", "A*c", "A/c"])
def test_complex_numpy_scalars_are_refused(make, model):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # NumPy's own word on the cast is no refusal
        with pytest.raises(TypeError):
            make(np.complex128(1 + 1j), model.soa.M)


@pytest.mark.parametrize("make", [lambda s, A: s * A, lambda s, A: A * s, lambda s, A: A + s], ids=["s*A", "A*s", "A+s"])
def test_scalars_beside_operators_are_refused_cleanly(make, model):
    M = model.soa.M
    with pytest.raises(TypeError) as caught:
        make(model.soa.D.trace(), M)
    assert "incompatible function arguments" not in str(caught.value)  # pybind11's dump of signatures


# ---------------------------------------------------------------------- two models, unknown names


def test_operators_of_two_models_do_not_combine(model):
    other, twin = pc.chain(3), every_kind()
    M = model.soa.M
    for make in (lambda: other.soa.H @ M, lambda: M + other.soa.M):
        with pytest.raises(pc.SpaceError, match=f"They belong to two different models, '.*{other.name}.*'"):
            make()
    with pytest.raises(pc.SpaceError, match="two different models, both named 'random40'"):
        model.soa.H @ twin.soa.M  # equal in every number, and not the same
    with pytest.raises(pc.SpaceError, match="two different models"):
        pc.vector("x", twin.soa.Theta).T @ pc.vector("x", model.soa.Theta)


def test_unknown_names(model):
    soa = model.soa
    for error, text, make in [
        (AttributeError, "no operator is called 'Phi'; there are E, phi,", lambda: soa.Phi),
        (AttributeError, "no operator is called 'X'", lambda: soa("H X")),
        (pc.ModelError, "no node or body of 'random40' is called 'nose'; there are", lambda: soa.B("nose")),
        (pc.ModelError, "node 'base_node' lies on the base", lambda: soa.Jacobian(["tip", "base_node"])),
        (pc.ModelError, "takes at least one node", lambda: soa.Lambda([])),
        (pc.ModelError, "no coordinate of 'random40' is called 'hinge99'; there are", lambda: soa.Delta("hinge99")),
        (pc.ModelError, "coordinate 25 of 'random40', which has 25", lambda: soa.Delta(25)),
        (KeyError, "no body of 'random40' is called 'nose'", lambda: model.bodies["nose"]),
        (KeyError, "no hinge of 'random40' is called 'nose'", lambda: model.hinges["nose"]),
        (
            pc.EvaluationError,
            "no precision is called 'half'; there are 'single', 'double', 'extended', 'quad', and 50 and 100 digits",
            lambda: soa.M.at(model.q, precision="half"),
        ),
        (
            pc.EvaluationError,
            "no form .* is called 'joseph'; there are 'fast', 'ud' and 'square-root'",
            lambda: soa.P.at(model.q, form="joseph"),
        ),
        (pc.EvaluationError, "no plan is made for 'solve'; there are apply", lambda: soa.P.plan("solve")),
    ]:
        with pytest.raises(error, match=text):
            make()
    assert soa.Delta("hinge3") == soa.Delta(model.coordinate_names.index("hinge3"))
    with pytest.raises(AttributeError, match="operator of mechanics"):
        getattr(pc.sko_model([-1], [None], [np.eye(1)], [np.eye(1)]), "V_tilde")  # noqa: B009 - the call is what is tested


def test_states_of_the_wrong_size(model):
    M, nq, nv = model.soa.M, model.nq, model.nv
    for text, make in [
        (f"takes {nq} numbers .*, not 3", lambda: M.at(np.ones(3))),
        (f"takes {nq} numbers .*, not 4", lambda: M.at(np.ones((2, 4)))),
        ("a state is an array", lambda: M.at(np.ones((2, 2, nq)))),
        (f"v has not the shape that goes with q: \\({nv},\\) or \\(B, {nv}\\)", lambda: M.at(model.q, np.ones(2))),
        ("v has not the shape", lambda: M.at(np.tile(model.q, (2, 1)), np.ones((3, nv)))),
        (f"takes {nq} numbers .*, not 1", lambda: setattr(model, "q", [1.0])),
        (f"v of .* takes {nv} numbers, not 1", lambda: setattr(model, "v", [1.0])),
    ]:
        with pytest.raises(pc.ModelError, match=text):
            make()


def test_constants_of_the_wrong_shape_or_with_nan(model):
    soa = model.soa
    n = len(soa.Theta)
    sizes = [s.stop - s.start for _, s, _ in soa.F.blocks]
    for error, text, make in [
        (
            pc.SpaceError,
            f"takes an array \\({n}, {n}\\), or one diagonal, or a list",
            lambda: pc.constant(np.ones((2, n)), soa.Theta, soa.Theta),
        ),
        (pc.SpaceError, "a diagonal of 2 numbers does not map", lambda: pc.constant(np.ones(2), soa.Theta, soa.Theta)),
        (pc.SpaceError, "block 0 has 4 entries, not 6 x 6", lambda: pc.constant([np.ones((2, 2))] * len(sizes), soa.F, soa.F)),
        (
            pc.EvaluationError,
            "constant 'N' has an entry that is not a finite number",
            lambda: pc.constant(np.full(n, np.nan), soa.Theta, soa.Theta, "N"),
        ),
        (pc.EvaluationError, "not a finite number", lambda: pc.constant(np.full((n, n), np.inf), soa.Theta, soa.Theta)),
    ]:
        with pytest.raises(error, match=text):
            make()


def test_nan_in_the_blocks_of_a_constant(model):
    soa = model.soa
    blocks = [np.full((s.stop - s.start,) * 2, np.nan) for _, s, _ in soa.F.blocks]
    with pytest.raises(pc.EvaluationError, match="not a finite number"):
        pc.constant(blocks, soa.F, soa.F)


def test_too_large_to_be_dense():
    arm = pc.chain(2000)
    D, phi = arm.soa("D phi")
    with pytest.raises(pc.EvaluationError, match="12000 x 12000 entries: too many for a dense matrix"):
        phi.dense()
    with pytest.raises(pc.EvaluationError, match="too many"):
        np.asarray(phi @ phi)
    assert (phi @ np.ones(12000)).shape == (12000,) and D.diagonal().shape == (2000,)
    assert len(repr(phi)) < 100


# ---------------------------------------------------------------------- equality, spaces (rulings 3 and 5)


def test_equality_is_structural_after_flattening(model):
    H, phi, M, psi, P = model.soa("H phi M psi P")
    assert H @ (phi @ M) == (H @ phi) @ M == H * phi * M and hash(H @ (phi @ M)) == hash((H @ phi) @ M)
    assert (phi + psi) + phi.inv() == phi + (psi + phi.inv()) and phi + psi == psi + phi and hash(phi + psi) == hash(psi + phi)
    assert H @ (phi + psi) != H @ phi + H @ psi
    assert phi @ psi != psi @ phi and M != P and phi.T != phi and phi.inv() != phi and 2 * phi != 3 * phi and phi + phi != 2 * phi
    assert (phi == phi) is True and (phi != phi) is False
    assert phi != 1 and phi != "phi" and (phi == np.ones(3)) is not True
    assert len({phi, psi, phi, H @ phi, H * phi}) == 3
    assert model.soa.phi == phi and pc.chain(2).soa.phi != pc.chain(2).soa.phi
    assert model.soa.B(["tip"]) == model.soa.B("tip") != model.soa.B("body10")


def test_constructors_never_rewrite(model):
    H, phi, M, tau = model.soa("H phi M tau")
    assert (phi @ phi.inv()).text() == "φ φ⁻¹" and (phi - phi).text() == "φ − φ" and M.inv().inv().text() == "M⁻¹⁻¹"
    assert (tau @ tau).text() == "τ τ" and (H @ phi).T.text() == "(H φ)*" and phi.T.T.text() == "φ**"
    assert (2 * (3 * M)).kind == "scaled" and (2 * (3 * M)).children[0].kind == "scaled"


def test_transposition_swaps_dual_spaces(model):
    soa = model.soa
    V, F, Theta = soa.V, soa.F, soa.Theta
    assert V.dual == F and F.dual == V and Theta.dual == Theta and V != F and len(V) == len(F) == 6 * len(model.bodies)
    spaces = {
        "E phi psi phi_tilde psi_tilde E_psi tau tau_bar V_bar Delta_theta_dot": (F, F),
        "M P R P_plus momentum_cross": (V, F),
        "Upsilon Omega": (F, V),
        "H H_dot": (F, Theta),
        "G K": (Theta, F),
        "D J": (Theta, Theta),
        "V_tilde": (V, V),
    }
    for names, (domain, codomain) in spaces.items():
        for name in names.split():
            op = getattr(soa, name)
            assert (op.domain, op.codomain) == (domain, codomain) and op.shape == (len(codomain), len(domain))
            assert (op.T.domain, op.T.codomain) == (codomain.dual, domain.dual)
    B, J, L = soa.B("tip"), soa.Jacobian("tip"), soa.Lambda("tip")
    nodes_v, nodes_f = soa.NodesV("tip"), soa.NodesF("tip")
    assert nodes_v.dual == nodes_f and (B.domain, B.codomain) == (nodes_f, F) and (J.domain, J.codomain) == (Theta, nodes_v)
    assert (L.domain, L.codomain) == (nodes_v, nodes_f) and soa.NodesV("body1") != nodes_v
    two = soa.NodesF(["tip", "body1"])
    assert len(two) == 12 and [label for label, _, _ in two.blocks] == ["tip", "body1"]


def test_blocks_are_labelled(model):
    MM = mass_matrix(model)
    view = MM.blocks()
    assert view.rows == view.columns == list(model.hinges)
    dense = MM.dense()
    for row in view.rows:
        for column in view.columns:
            assert np.array_equal(view[row, column], dense[model.hinges[row].v_slice, model.hinges[column].v_slice])
    assert MM.blocks(order="tip-to-base").rows == view.rows[::-1]
    with pytest.raises(KeyError, match="no block row or column is called 'x'"):
        view["x", "hinge1"]
    with pytest.raises(pc.EvaluationError, match="there are 'base-to-tip' and 'tip-to-base'"):
        MM.blocks(order="down")


def test_spaces_list_their_blocks_in_the_models_order(model):
    assert list(model.bodies) == [label for label, _, _ in model.soa.F.blocks]
    for label, where, body in model.soa.Theta.blocks:
        assert where == model.hinges[label].v_slice and list(model.hinges)[body] == label
