"""Parts of TOML files: angles that give a rotation to the last bit, and documents that the standard library reads."""

import sys

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pycraft.models.loaders import rotations
from pycraft.models.loaders.rotations import nearest_rpy, rotation_from_rpy, rpy_of_rotation
from pycraft.models.writers.toml_text import Inline, document

NAMES = st.text(st.characters(exclude_categories=["Cs"]), min_size=1, max_size=12)
NUMBERS = st.floats(allow_nan=False, allow_infinity=False, allow_subnormal=True, width=64)


def vectors(numbers, size=3):
    return st.lists(numbers, min_size=size, max_size=size)


@given(angles=vectors(st.one_of(st.floats(-3.14, 3.14), st.sampled_from([0.0, np.pi / 2, -np.pi / 2, np.pi, 1.5707963, 1e-9]))))
def test_three_angles_give_the_rotation_to_rounding(angles):
    R = rotation_from_rpy(*angles)
    assert abs(rotation_from_rpy(*nearest_rpy(R)) - R).max() < 1e-15
    found = rpy_of_rotation(R)
    assert found is None or rotation_from_rpy(*found).tobytes() == R.tobytes()


@given(angles=vectors(st.decimals(-3, 3, places=4).map(float)))
def test_angles_of_few_digits_are_found_again(angles):
    found = rpy_of_rotation(rotation_from_rpy(*angles))
    if abs(angles[1]) < 1.57:  # else other angles give the same rotation
        assert found is None or np.array_equal(found, angles)


def test_most_angles_of_few_digits_are_found(tmp_path):
    rng = np.random.default_rng(0)
    drawn = np.round(rng.uniform(-1.5, 1.5, (200, 3)), 3)
    assert sum(rpy_of_rotation(rotation_from_rpy(*angles)) is not None for angles in drawn) > 190


def test_three_angles_keep_their_digits_where_pitch_is_upright():
    """Yaw is rounding alone there, and roll is what is left of it."""
    rng, R = np.random.default_rng(0), rotation_from_rpy(0, np.pi / 2, 0)
    for _ in range(200):
        A, B = rotation_from_rpy(*rng.uniform(-3, 3, 3)), rotation_from_rpy(rng.uniform(-3, 3), 0, 0)
        upright = A @ (A.T @ R @ B)  # to rounding
        assert abs(rotation_from_rpy(*nearest_rpy(upright)) - upright).max() < 2e-15


def test_zeros_with_a_sign_do_not_hang_on_what_was_read_before():
    turned = []
    for zero in (0.0, -0.0):
        rotations._rotation_from_rpy.cache_clear()
        turned.append(rotation_from_rpy(zero, zero, 1.0).tobytes())
    assert turned[0] == turned[1]


@given(
    st.recursive(
        st.one_of(NAMES, st.booleans(), NUMBERS),
        lambda inner: st.one_of(st.lists(inner, max_size=4), st.dictionaries(NAMES, inner, max_size=4)),
    )
)
def test_documents_are_read_as_they_were(value):
    """By the reader of the standard library: any text, number and table, sections within sections."""
    if sys.version_info < (3, 11):
        pytest.skip("tomllib comes with Python 3.11")
    import tomllib

    assert tomllib.loads(document({"value": value})) == {"value": value}
    if isinstance(value, dict):
        assert tomllib.loads(document({"value": Inline(value)}))["value"] == value
