"""Plans in HTML: every step with its cost, and each pass on the tree with arrows the way it goes."""

import re

import pytest

import pycraft as pc
from pycraft.models.tree_places import tree_places
from pycraft.operators.shown_expression import flops_text
from pycraft.view.plan_picture import _INWARD, _OUTWARD, MOST

TREE = pc.tree([-1, 0, 0, 1], ["pin", "ball", "pin", "slider"], seed=1)


def cards(page):
    return re.findall(r"<b>\d+\. ([^<]+)</b>(.*?)</pre>", page, re.S)


def test_steps_and_passes():
    made = TREE.soa.MM.inv().explain()
    page = made._repr_html_()
    for step in made.expression.plan().steps:
        assert step["text"] in page and flops_text(step["flops"]) in page
    assert [way for way, _ in cards(page)] == ["tip to base", "base to tip"]
    (_, inward), (_, outward) = cards(page)
    assert inward.count(_INWARD) == 4 and not inward.count(_OUTWARD) and outward.count(_OUTWARD) == 4  # an arrow a link
    assert "P(k) = M(k)" in inward and inward.count("<circle") == 4
    assert str(made) == repr(made) and page.count("<div") == page.count("</div>") and "<script" not in page


def test_arrows_point_the_way_that_is_passed():
    """The head's tip is nearer to the base, which is at the left, where the tree is passed to the base."""
    page = pc.chain(1).soa.MM.inv().explain()._repr_html_()
    for (_, card), sign in zip(cards(page), (-1, 1), strict=True):
        tip, left, right = ([float(x) for x in p.split(",")] for p in re.search(r'points="([^"]+)"', card)[1].split())
        assert sign * (tip[0] - left[0]) > 0 and left[0] == right[0] and tip[1] == (left[1] + right[1]) / 2


def test_passes_of_eliminations_and_of_the_whole():
    soa = TREE.soa
    found = soa.MM.inv().algorithm().passes() + (soa.MM + 0.1 * soa.I).inv().algorithm().passes()
    assert [one.ways for one in found] == [(-1,), (1,), (-1,), (-1, 1), ()] and {one.parents for one in found} == {
        tuple(soa._source.parents)
    }
    page = (soa.MM + 0.1 * soa.I).inv().explain()._repr_html_()
    both = dict(cards(page))["tip to base, then base to tip"]
    assert both.count(_INWARD) == both.count(_OUTWARD) == 4
    written = soa.MM.inv().algorithm()
    assert [line for one in written.passes() for line in one.lines] == written.lines()


@pytest.mark.parametrize("model", [pc.Multibody("nothing"), pc.chain(1), pc.tree([-1, -1], ["weld", "weld"], seed=1), pc.chain(MOST + 1)])
def test_small_and_large(model):
    page = model.soa.MM.explain()._repr_html_()
    assert ("too many to draw" in page) == (len(model.bodies) > MOST) and "nan" not in page


@pytest.mark.parametrize("request_", ["dense", "diagonal", "trace", "logdet"])
def test_what_else_is_asked_of_an_expression(request_):
    made = TREE.soa.MM.explain(request_)
    assert made.request == request_ and made.split("\n")[1] in made._repr_html_()


def test_places_of_a_tree():
    assert tree_places([]).tolist() == [[0.5, 0.0]]
    assert tree_places([-1, 0, 0]).tolist() == [[0.5, 0.5], [0.25, 1.0], [0.75, 1.0], [0.5, 0.0]]
    assert tree_places([-1, -1, 0])[:, 1].tolist() == [0.5, 0.5, 1.0, 0.0]
