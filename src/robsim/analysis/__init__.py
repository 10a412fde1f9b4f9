"""Analysis of runs and tasks: comparison, diagnosis, explanation, equilibria and workspaces."""

from robsim.base.lazy_names import attach_names

__getattr__, __dir__, __all__ = attach_names(__name__, __file__)
