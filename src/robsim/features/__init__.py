"""The visual features that a controller regulates, each imported when it is first used."""

from robsim.declare.families import kinds_by_class

__getattr__ = kinds_by_class("feature")
