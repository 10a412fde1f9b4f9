"""Visual features that a servo task drives to their goal."""

from robsim.base.lazy_names import attach_names

__getattr__, __dir__ = attach_names(__name__, __file__)
