"""The HTML page that shows runs, scenes, robots and studies in a browser."""

from robsim.base.lazy_names import attach_names

__getattr__, __dir__, __all__ = attach_names(__name__, __file__)
