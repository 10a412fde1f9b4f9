"""Cameras and image geometry: poses, homographies, triangulation, tags and boards."""

from robsim.base.lazy_names import attach_names

__getattr__, __dir__, __all__ = attach_names(__name__, __file__)
