"""Pictures of bodies as a camera sees them, without a graphics card."""

from robsim.base.lazy_names import attach_names

__getattr__, __dir__, __all__ = attach_names(__name__, __file__)
