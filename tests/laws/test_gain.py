"""Gains, fixed and adaptive."""

import copy
import pickle

import numpy as np
import pytest

from robsim.base.errors import InputError
from robsim.kernels.formulas import adaptive_gain as kernels
from robsim.servo.laws.gain import GAIN as DECLARED
from robsim.servo.laws.gain import AdaptiveGain

GAIN = AdaptiveGain(at_zero=4.0, at_infinity=0.4, slope=30.0)


def test_it_has_its_two_ends_and_its_slope():
    h = 1e-6
    at_zero, near, far = GAIN.at(np.array([0.0, h, 1e6]))
    assert (at_zero, far) == (4.0, 0.4)
    assert (at_zero - near) / h == pytest.approx(30.0, rel=1e-5)
    assert GAIN.least == 0.4


def test_it_is_the_published_formula():
    x = np.linspace(0, 1, 50)
    np.testing.assert_allclose(GAIN.at(x), 3.6 * np.exp(-30 * x / 3.6) + 0.4, rtol=1e-15)
    assert (np.diff(GAIN.at(x)) < 0).all()


def test_it_is_elementwise_in_any_batch():
    x = np.random.default_rng(0).uniform(0, 1, 37)
    whole = GAIN.at(x)
    for part in (slice(0, 1), slice(3, 20), slice(36, None)):
        np.testing.assert_array_equal(GAIN.at(x[part]), whole[part])


def test_an_error_without_bound_gives_the_least_gain():
    np.testing.assert_array_equal(GAIN.at(np.array([1e300])), GAIN.least)
    gain = np.empty(1)
    kernels.compute_gains(GAIN.at_zero, GAIN.at_infinity, GAIN.slope, np.array([np.inf]), gain)
    assert gain[0] == GAIN.least


@pytest.mark.parametrize("again", [copy.deepcopy, lambda v: pickle.loads(pickle.dumps(v))])
def test_it_is_a_value(again):
    assert again(GAIN) == GAIN == AdaptiveGain(4, 0.4, 30, "error")
    assert hash(again(GAIN)) == hash(GAIN) != hash(AdaptiveGain(4, 0.4, 30, "command"))


@pytest.mark.parametrize(
    "arguments, message",
    [
        ((0.0, 0.4, 30.0), r"at_zero must be a positive number \(per second\), got 0"),
        ((4.0, -0.4, 30.0), r"at_infinity must be a positive number \(per second\)"),
        ((4.0, 0.4, 0.0), "slope must be a positive number"),
        ((4.0, 0.4, np.nan), "slope: nan"),
        ((4.0, 4.0, 30.0), "at_zero must be above at_infinity, got 4.0 and 4.0"),
        (("4", 0.4, 30.0), "at_zero: expected a number, got '4'"),
        ((4.0, 0.4, 30.0, "comand"), r"no size 'comand'; .* 'command'\? sizes: error, command"),
        ((4.0, 0.4, 30.0, ["error"]), r"no size \['error'\]"),
    ],
)
def test_an_invalid_adaptive_gain_is_refused(arguments, message):
    with pytest.raises(InputError, match=message):
        AdaptiveGain(*arguments)


def test_a_gain_is_a_positive_number_or_adaptive():
    assert DECLARED.check(GAIN, "gain") is GAIN
    two = DECLARED.check(2, "gain")
    assert two == 2.0 and type(two) is float
    for bad in (0, -1, [1, 2]):
        with pytest.raises(InputError, match=r"gain must be a positive number \(per second\), got"):
            DECLARED.check(bad, "gain")
    for bad in (np.inf, None, True, {}):
        with pytest.raises(InputError, match=r"gain: .* number"):
            DECLARED.check(bad, "gain")
    with pytest.raises(InputError, match="no gain 'fast'; gains: adaptive, or a positive number"):
        DECLARED.check("fast", "gain")
