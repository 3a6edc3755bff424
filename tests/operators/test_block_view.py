"""Block views: entries of small operators, signed numbers of large ones, readable on white and on black, wide models within the page."""

import re

import numpy as np
import pytest

import pycraft as pc


@pytest.fixture(scope="module")
def small():
    return pc.tree([-1, 0, 1, 1], ["pin", "ball", "slider", "pin"], seed=1)


def mass_matrix(model):
    H, phi, M = model.soa("H phi M")
    return H @ phi @ M @ phi.T @ H.T


def test_small_operators_show_their_entries(small):
    MM = mass_matrix(small)
    lines = repr(MM.blocks()).split("\n")
    assert lines[0] == "H φ M φ* H* : Θ → Θ" and lines[1].split() == ["hinge0", "hinge1[0]", "hinge1[1]", "hinge1[2]", "hinge2", "hinge3"]
    shown = [[0.0 if t == "·" else float(t) for t in line.split()[1:]] for line in lines[2:]]
    np.testing.assert_allclose(shown, MM.dense(), rtol=6e-3)  # three digits
    assert len({len(line) for line in lines[1:]}) == 1  # columns align
    html = MM.blocks()._repr_html_()
    assert html.count("<td") == 36 and "largest entry" not in html and "border-left:1px" in html and "hinge1[2]" in html


def test_large_operators_show_the_largest_entry_with_its_sign(small):
    phi = small.soa.phi
    view, dense = phi.blocks("tip-to-base"), phi.dense()
    rows = list(small.bodies)
    for i, r in enumerate(view.rows):
        for j, c in enumerate(view.columns):
            block = dense[6 * rows.index(r) :][:6, 6 * rows.index(c) :][:, :6]
            assert abs(view.largest()[i, j]) == np.abs(block).max() and view.largest()[i, j] in block
    assert np.array_equal(view.norms(), np.abs(view.largest())) and (view.largest() < 0).any()
    assert "largest entry of each block, with its sign" in repr(view) and "largest entry of each block" in view._repr_html_()
    assert re.search(r"body1 +-", repr(view))


def test_signs_have_colours_that_read_on_white_and_on_black(small):
    html = mass_matrix(small).blocks()._repr_html_()
    for cell in re.findall(r"<td style='([^']*)'>([^<]*)</td>", html):
        style, text = cell
        if text:
            assert ("230,120,30" in style) == text.startswith("-") and "color:#" not in style.replace("background", "")
            assert float(re.search(r"rgba\([\d,]+,([\d.]+)\)", style)[1]) <= 0.45  # the page's own ink stays legible
        else:
            assert "rgba" not in style


def test_wide_models_stay_within_the_page():
    view = pc.chain(45).soa.phi.blocks()
    assert max(map(len, repr(view).split("\n"))) <= 100 and "5 more rows" in repr(view) and "more columns" in repr(view)
    html = view._repr_html_()
    assert "max-width:100%" in html and "45 × 45 blocks<" in html and html.count("<title>") == 45 * 46 // 2


def test_a_picture_of_many_blocks_shows_all_of_them_several_to_a_cell():
    """Of a chain bent at right angles, φ has entries of either sign; cells are checked by what pointing at them tells."""
    model = pc.chain(101)
    model.q = np.linspace(0, 3, 101)
    view = model.soa.phi.blocks()
    largest, told = view.largest(), re.findall(r"<title>([^<]*)</title>", view._repr_html_())
    bodies = list(model.bodies)
    assert len(told) == sum(1 for i in range(34) for j in range(34) if np.any(largest[3 * i : 3 * i + 3, 3 * j : 3 * j + 3]))
    for text in told:
        row, column, number = re.fullmatch(r"(\w+)(?: … \w+)? × (\w+)(?: … \w+)?: (\S+)", text).groups()
        cell = largest[bodies.index(row) :][:3, bodies.index(column) :][:, :3]
        assert float(number) == pytest.approx(cell.ravel()[np.abs(cell).argmax()], rel=6e-3)  # three digits
    assert any(text.split(": ")[1].startswith("-") for text in told)
    assert f"{bodies[99]} … {bodies[100]} × " in " ".join(told)  # the last cell has two


def test_large_operators_are_looked_at_without_their_dense_form(monkeypatch):
    model = pc.tree([-1, 0, 1, 1, 3, 0], ["pin", "ball", "weld", "free", "pin", "slider"])
    model.q = model.random_state(seed=2).q
    H, phi = model.soa("H phi")
    for operator in (phi, H, H.T, H @ phi):
        kept = operator.blocks("tip-to-base").largest()
        monkeypatch.setattr("pycraft.operators.block_view._KEPT", 0)
        monkeypatch.setattr("pycraft.operators.block_view._COLUMNS", 7)
        view = operator.blocks("tip-to-base")
        np.testing.assert_allclose(view.largest(), kept, rtol=0, atol=1e-14 * np.abs(kept).max())  # of sums of up to six terms
        assert "values" not in vars(view) and np.array_equal(view.values, operator.dense())
        monkeypatch.undo()


def test_operators_without_entries():
    welds = pc.Multibody("weld")
    welds.add_body("base", hinge="weld", mass=1.0)
    view = welds.soa.H.blocks()
    assert "H : F → Θ" in repr(view) and "<table" in view._repr_html_()
