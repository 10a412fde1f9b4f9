"""The visual features that a controller regulates, each imported when it is first used."""

from robsim.declare.kind_families import make_kind_getattr

__getattr__ = make_kind_getattr("feature")
