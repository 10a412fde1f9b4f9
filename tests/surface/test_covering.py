"""The thinned products of choices contain every pair of choices, and no product is whole."""

from itertools import product
from types import SimpleNamespace

import pytest
from covering import covering, met, thin


def all_met(rows, strength):
    return set().union(*(met(row, strength) for row in rows))


@pytest.mark.parametrize("strength", [1, 2, 3])
def test_all_choices_meet_in_the_rows_that_are_left(strength):
    rows = list(product("abcd", range(3), "xy", "uvw"))
    chosen = covering(rows, strength)
    assert all_met([rows[k] for k in chosen], strength) == all_met(rows, strength)
    assert len(chosen) < {1: 5, 2: 16, 3: 50}[strength]  # of 72; at least 4, 12 and 36


def test_rows_that_are_not_there_are_not_needed():
    rows = [row for row in product("abc", "abc", "abc") if len(set(row)) == 3]
    assert covering(rows, 2) == list(range(6))  # in each a pair that no other has
    assert covering([row for row in rows for _ in range(2)], 2) == list(range(0, 12, 2))
    assert covering([], 2) == []


class Item:
    """The data of `thin` about a test that pytest has collected."""

    def __init__(self, name, marker, **choices):
        self.nodeid, self.marker, self.marks = f"{name}[{choices}]", marker, []
        self.callspec = SimpleNamespace(params=choices)

    def get_closest_marker(self, name):
        return self.marker if self.marker and self.marker.name == name else None

    def add_marker(self, mark):
        self.marks.append(mark.name)


def test_each_test_is_thinned_by_itself_and_only_on_request():
    pairs = pytest.mark.covering(2).mark
    whole = list(product("ab", "xy", "uv"))
    items = [
        Item(name, marker, first=a, second=b, third=c)
        for name, marker in (("one", pairs), ("two", pairs), ("whole", None))
        for a, b, c in whole
    ]
    thin(items)
    for k, left in enumerate((4, 4, 8)):
        rows = [row for row, item in zip(whole, items[8 * k :], strict=False) if not item.marks]
        assert len(rows) == left and all_met(rows, 2) == all_met(whole, 2)
    assert {mark for item in items for mark in item.marks} == {"full"}


def test_a_few_cases_are_chosen_from_first_to_last():
    items = [Item("one", pytest.mark.few(3).mark, case=case) for case in range(10)]
    thin(items)
    assert [k for k, item in enumerate(items) if not item.marks] == [0, 3, 6]
