"""Quantities with units: exact decimals, SI inside, and a sentence for every bad spelling."""

import math
from fractions import Fraction

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from robsim import units
from robsim.base.errors import UnitError
from robsim.units import parse

steady = settings(derandomize=True, max_examples=50, deadline=None)
POWERS = {"m": 0, "cm": -2, "mm": -3, "um": -6, "s": 0, "ms": -3}
LENGTHS, TIMES = ("m", "cm", "mm", "um"), ("s", "ms")


@pytest.mark.parametrize(
    ("text", "dimension", "value"),
    [
        ("22.86 cm", "length", 0.2286),
        ("26.04 cm", "length", 0.2604),
        ("0.95 cm", "length", 0.0095),
        ("1.1 um", "length", 1.1e-6),
        ("3 mm", "length", 0.003),
        ("-7 m", "length", -7.0),
        ("40 ms", "time", 0.04),
        ("1.5 s", "time", 1.5),
        ("90 deg", "angle", math.pi / 2),
        ("-180 deg", "angle", -math.pi),
        ("0.3 rad", "angle", 0.3),
        ("1.2 kg", "mass", 1.2),
        ("35 g", "mass", 0.035),
        ("2.7 g/cm^3", "density", 2700.0),
        ("1e3 kg/m^3", "density", 1000.0),
        ("0.1 kg m^2", "inertia", 0.1),
        ("3 g cm^2", "inertia", 3e-7),
    ],
)
def test_a_quantity_is_the_double_nearest_to_its_decimal(text, dimension, value):
    assert parse(text, dimension) == value


@steady
@given(st.integers(-(10**17), 10**17), st.integers(-30, 30), st.sampled_from(sorted(POWERS)))
def test_every_decimal_with_a_metric_unit_is_rounded_once(digits, exponent, unit):
    """The exact rational number, rounded once, equals the result of float(Fraction)."""
    dimension = "length" if unit in LENGTHS else "time"
    exact = Fraction(digits) * Fraction(10) ** (exponent + POWERS[unit])
    assert parse(f"{digits}e{exponent} {unit}", dimension) == float(exact)


@steady
@given(st.floats(-1e6, 1e6, allow_nan=False))
def test_a_number_in_the_base_unit_comes_back_as_it_was(x):
    assert parse(f"{x!r} m", "length") == x
    assert parse(f"{x!r} s", "time") == x
    assert parse(f"{x!r} rad", "angle") == x


@steady
@given(st.floats(-1e4, 1e4, allow_nan=False))
def test_degrees_are_the_degrees_of_the_mathematics_library(x):
    assert parse(f"{x!r} deg", "angle") == pytest.approx(math.radians(x), rel=4e-16, abs=1e-320)


@pytest.mark.parametrize(
    "text", ["1.5e1cm", " 15 cm", "15 cm ", "\t15\ncm", "+15 cm", "15. cm", ".15e2 cm", "150E-1 cm"]
)
def test_spaces_signs_and_exponents_may_be_written_in_any_usual_way(text):
    assert parse(text, "length") == 0.15


@pytest.mark.parametrize("text", ["1, 2, 3 mm", "1 2 3 mm", "1,2,3mm", " 1 ,2 , 3 mm "])
def test_a_vector_has_one_unit_behind_its_numbers(text):
    assert parse(text, "length", count=3) == (0.001, 0.002, 0.003)


def test_a_vector_of_one_number_is_still_a_vector():
    assert parse("5 mm", "length", count=1) == (0.005,)


@pytest.mark.parametrize("unit", [*LENGTHS, *TIMES, "rad", "deg"])
def test_the_constants_agree_with_the_spellings(unit):
    dimension = "length" if unit in LENGTHS else "time" if unit in TIMES else "angle"
    assert 3 * getattr(units, unit) == pytest.approx(parse(f"3 {unit}", dimension), rel=1e-15)


@pytest.mark.parametrize(
    "text",
    [
        "",
        "cm",
        "22.86",
        "22.86 inch",
        "22.86 CM",
        "22.86 µm",
        "22.86 %",
        "22.86 deg",
        "22.86 ms",
        "22.86 cm cm",
        "cm 22.86",
        "22.86 cm/s",
        "22,86 cm",
        "1 2 cm",
        "1 cm, 2 cm",
        "1 e3 cm",
        "1_000 cm",
        "1.2.3 cm",
        "--1 cm",
        "1e cm",
        "e cm",
        ". cm",
        "- cm",
        ", cm",
        "0x10 cm",
        "nan cm",
        "inf cm",
        "1e400 cm",
        "-1e400 cm",
        "1e999999999999999999999 cm",
        "٣ cm",
        "1+1 cm",
        "1" * 2000 + " cm",
        " " * 998 + "!",  # and at once: no spelling takes long to refuse
        "1" + " " * 900 + "cm!",
        0.2286,
        True,
        None,
        b"1 cm",
        ["1 cm"],
    ],
)
def test_a_bad_spelling_of_one_length_is_reported_with_the_expected_one(text):
    with pytest.raises(UnitError) as caught:
        parse(text, "length")
    assert repr(text) in str(caught.value)
    assert "expected one number with a unit of length (m, cm, mm, um), as in" in str(caught.value)


@pytest.mark.parametrize(
    ("text", "numbers"), [("1, 2 cm", 2), ("1, 2, 3, 4 cm", 4), ("1 cm", 1), (",, cm", 0)]
)
def test_a_wrong_count_is_reported(text, numbers):
    with pytest.raises(UnitError, match=f"has {numbers} numbers, not 3: expected a vector with"):
        parse(text, "length", count=3)


@pytest.mark.parametrize(
    ("dimension", "words"),
    [
        ("length", "length (m, cm, mm, um)"),
        ("angle", "angle (rad, deg)"),
        ("time", "time (s, ms)"),
        ("speed", "speed (m/s, cm/s, mm/s)"),
        ("turn rate", "turn rate (rad/s, deg/s)"),
    ],
)
def test_the_message_lists_the_units_of_the_dimension_and_an_example_that_is_right(
    dimension, words
):
    with pytest.raises(UnitError) as caught:
        parse("1 parsec", dimension)
    assert f"a unit of {words}" in str(caught.value)
    example = str(caught.value).split('as in "')[1].rstrip('"')
    assert parse(example, dimension) == 1.5


@steady
@given(st.text(alphabet="0123456789.,+-eE \tmcuµ%radegsn_", max_size=12))
def test_any_text_is_a_finite_number_or_a_unit_error(text):
    try:
        value = parse(text, "length")
    except UnitError:
        return
    assert isinstance(value, float)
    assert math.isfinite(value)


def test_speeds_and_turn_rates_are_read():
    assert parse("30 cm/s", "speed") == 0.3 and parse("5 mm/s", "speed") == 0.005
    assert parse("180 deg/s", "turn rate") == math.pi and parse("2 rad/s", "turn rate") == 2.0
    for text in ("1 cm", "1 cm/", "1 /s", "1 cm / s", "1 deg/s", "1 km/s"):
        with pytest.raises(UnitError, match="unit of speed"):
            parse(text, "speed")


def test_a_unit_error_is_a_value_error_too():
    assert issubclass(UnitError, ValueError)
