"""Studies: thousands of runs of an experiment with varied numbers, choices and starts."""

from robsim.base.lazy_names import attach_names

__getattr__, __dir__ = attach_names(__name__, __file__)
