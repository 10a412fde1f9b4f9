"""Studies: an experiment run many times with other numbers and starts, stored as tables."""

from robsim.base.lazy_names import attach_names

__getattr__, __dir__ = attach_names(__name__, __file__)
