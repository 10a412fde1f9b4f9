"""Visual features that a controller regulates, each imported at its first use."""

from robsim.base.lazy_names import attach_names

__getattr__, __dir__ = attach_names(__name__, __file__)
