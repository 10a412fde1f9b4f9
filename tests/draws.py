"""Properties of random values; a few values are tried by default and the rest by `full`."""

import pytest
from hypothesis import given, settings


def try_samples(few, many, **strategies):
    """Let a property be tried with a few draws by default, and with many by `full`."""

    def tried(check):
        @pytest.mark.parametrize("draws", [few, pytest.param(many, marks=pytest.mark.full)])
        def test(draws):
            settings(max_examples=draws, deadline=None, derandomize=True)(
                given(**strategies)(check)
            )()

        test.__name__ = check.__name__
        test.__doc__ = check.__doc__
        return test

    return tried
