"""Units for input, as numbers: `from robsim.units import cm, deg`.

RobSim computes in metres, radians and seconds. A length, angle or time in another unit is a product
with the unit, such as `5 * cm`. The units are m, cm, mm, um, rad, deg, s and ms. `parse` converts a
text such as "5 cm", and a `Dimension` is the name of a physical dimension.

>>> print(5 * cm, round(90 * deg, 4), parse("250 ms", "time"))
0.05 1.5708 0.25
"""

from robsim.base.si_units import Dimension, cm, deg, m, mm, ms, parse, rad, s, um

__all__ = ["Dimension", "cm", "deg", "m", "mm", "ms", "parse", "rad", "s", "um"]
