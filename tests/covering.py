"""Covering arrays: few rows of a large product that contain every pair of choices.

Most faults depend on one choice or on a pair of choices (Kuhn, Wallace and Gallo, IEEE Transactions
on Software Engineering 30(6), 2004), and all pairs fit into far fewer rows than a product has.
"""

from itertools import combinations, groupby

import pytest


def thin(items):
    """Mark as `full` the cases of tests that do not run by default.

    Of a test marked `covering(strength)` those rows run that add something to others, and of a test
    marked `few(count)` as many cases, evenly distributed.
    """
    for cases, strength in _group_cases(items, "covering"):
        rows = [tuple(map(repr, item.callspec.params.values())) for item in cases]
        _mark_others(cases, covering(rows, strength))
    for cases, count in _group_cases(items, "few"):
        _mark_others(cases, [k * len(cases) // count for k in range(count)])


def _group_cases(items, name):
    """Yield the cases of each test with a mark, except those of `full`, and its argument."""
    marked = [
        item
        for item in items
        if item.get_closest_marker(name) and not item.get_closest_marker("full")
    ]
    for _, group in groupby(marked, lambda item: item.nodeid.partition("[")[0]):
        cases = list(group)
        yield cases, *cases[0].get_closest_marker(name).args


def _mark_others(cases, chosen):
    """Mark as `full` all cases but the chosen ones."""
    for k in set(range(len(cases))).difference(chosen):
        cases[k].add_marker(pytest.mark.full)


def covering(rows, strength):
    """Return indices of rows that contain every pair of choices of all rows.

    A choice is a value in a column; `strength` of them meet in a row that has them all. Greedy:
    the next row is the first of those that add most.
    """
    left = [met(row, strength) for row in rows]
    chosen = []
    while any(left):
        best = max(range(len(rows)), key=lambda k: len(left[k]))
        chosen.append(best)
        new = left[best]
        left = [each - new for each in left]
    return sorted(chosen)


def met(row, strength):
    """The choices, `strength` at a time and with their columns, that meet in a row."""
    return set(combinations(enumerate(row), strength))
