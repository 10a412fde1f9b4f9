"""Studies: many simulations of an experiment with varied numbers and starts, as tables."""

from robsim.base.lazy_names import attach_names

__getattr__, __dir__, __all__ = attach_names(__name__, __file__)
