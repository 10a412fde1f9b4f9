"""Every feature of the table: L is the derivative of s, at a thousand random views each."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import robsim.features
from robsim.declare import family
from robsim.servo.bound_block import BoundBlock
from robsim.testing import _RandomViews, check_feature

EVERY = family("feature").kinds
# features of pictures: tests/pictures/test_picture_features.py, test_direct_servoing.py
FEATURES = {name: kind for name, kind in EVERY.items() if not getattr(kind, "uses_pictures", False)}

ANGLE = np.linspace(0, 2 * np.pi, 7, endpoint=False)
CIRCLE = 0.2 * np.column_stack([np.cos(ANGLE), np.sin(ANGLE), np.zeros(7)])
SPREAD = np.array([[-0.3, -0.2, 0.1], [0.25, -0.3, -0.05], [0.3, 0.2, 0.05], [-0.2, 0.3, -0.1]])
L_SHAPE = np.array(
    [[-0.3, -0.3, 0], [0.3, -0.3, 0], [0.3, -0.1, 0], [0, -0.1, 0], [0, 0.3, 0], [-0.3, 0.3, 0]]
)
# marks that a feature needs; by default four marks anywhere. Marks of angles stay away
# from the centre of the image, where polar coordinates have none, and edges recede
MARKS = {
    "polar": SPREAD + np.array([0.9, 0.7, 0.0]),
    "vanishing_point": [[-0.3, -0.2, -0.3], [-0.3, -0.2, 0.3], [0.3, 0.2, -0.3], [0.3, 0.2, 0.3]],
    "ellipse": CIRCLE,
    "sphere": [[0, 0, 0]],
    "region_moments": L_SHAPE,
    "point_moments": L_SHAPE,
    "decoupled_moments": L_SHAPE,
}


@settings(derandomize=True, max_examples=5, deadline=None)
@given(seed=st.integers(0, 2**32))
@pytest.mark.parametrize("name", FEATURES)
@pytest.mark.few(2)
def test_its_interaction_matrix_is_a_derivative_of_second_order(name, seed):
    """check_feature: central differences along six motions; their error shrinks as h squared."""
    assert check_feature(FEATURES[name](), MARKS.get(name, SPREAD), seed, runs=200, bits=True) == []


@pytest.mark.parametrize("name", FEATURES)
def test_on_which_marks_its_numbers_depend_is_the_same_in_every_view(name):
    """Hiding mark after mark in one view gives the effect of hidden marks in all other views."""
    feature = FEATURES[name]()
    views, rng = _RandomViews.random(MARKS.get(name, SPREAD), 1, 60), np.random.default_rng(2)
    seen = views.observe(feature)
    cameras, N = getattr(feature, "cameras", 1), len(seen.pixels_last)
    block = BoundBlock(feature, (None,) * cameras, None, None, 1.0)
    depends = block.depends(views.select_runs([0]).observe(feature))
    hidden = rng.uniform(size=(cameras, N, 60)) < 0.3
    expected = (depends[..., None] & hidden).any(axis=(1, 2))
    np.testing.assert_array_equal(block.gone(seen.blind(list(hidden))), expected)
    assert depends.any(axis=(1, 2)).all()


def test_every_feature_is_in_the_room_of_features():
    assert all(getattr(robsim.features, kind.__name__) is kind for kind in EVERY.values())
