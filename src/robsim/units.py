"""Units at the doors: `from robsim.units import cm, deg`; inside, metres, radians and seconds."""

from robsim.base.si_units import Dimension, cm, deg, m, mm, ms, parse, rad, s, um

__all__ = ["Dimension", "cm", "deg", "m", "mm", "ms", "parse", "rad", "s", "um"]
