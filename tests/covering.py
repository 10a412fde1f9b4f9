"""Covering arrays: few rows of a large product that contain every pair of choices.

Most faults depend on one choice or on a pair of choices (Kuhn, Wallace and Gallo, IEEE Transactions
on Software Engineering 30(6), 2004), and all pairs fit into far fewer rows than a product has.
"""

from itertools import combinations, groupby

import pytest


def thin(items):
    """Mark as `full` the rows of a test marked `covering(strength)` that add nothing to others."""
    thinned = [item for item in items if item.get_closest_marker("covering")]
    for _, group in groupby(thinned, lambda item: item.nodeid.partition("[")[0]):
        product = list(group)
        rows = [tuple(map(repr, item.callspec.params.values())) for item in product]
        needed = covering(rows, *product[0].get_closest_marker("covering").args)
        for k in set(range(len(rows))).difference(needed):
            product[k].add_marker(pytest.mark.full)


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
