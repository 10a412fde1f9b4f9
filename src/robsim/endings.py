"""Endings of a run: conditions of the scene that stop a simulation."""

from robsim.engine.endings import ControlInstant as ControlInstant
from robsim.engine.endings import Ending as Ending
from robsim.engine.endings import Region as Region
from robsim.engine.endings import TooClose as TooClose
