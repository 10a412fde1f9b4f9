"""The fields of the kinds that need the extra `vision` act, or are refused."""

import pytest
from laws.test_parameters_act import NEED_VISION, effects


@pytest.mark.parametrize("label", NEED_VISION)
def test_each_field_of_a_kind_acts_or_is_refused(label):
    _, dead = effects(label)
    assert not dead, f"{label}: without effect: {dead}"
