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
    assert "overflow-x:auto" in html and "the first 40 of 45 × 45 blocks" in html and html.count("<tr>") == 41


def test_operators_without_entries():
    welds = pc.Multibody("weld")
    welds.add_body("base", hinge="weld", mass=1.0)
    view = welds.soa.H.blocks()
    assert "H : F → Θ" in repr(view) and "<table" in view._repr_html_()
