"""Units at the doors: `from robsim.units import cm, deg`."""

from robsim.base.units import Dimension as Dimension
from robsim.base.units import cm as cm
from robsim.base.units import deg as deg
from robsim.base.units import m as m
from robsim.base.units import mm as mm
from robsim.base.units import ms as ms
from robsim.base.units import parse as parse
from robsim.base.units import rad as rad
from robsim.base.units import s as s
from robsim.base.units import um as um
