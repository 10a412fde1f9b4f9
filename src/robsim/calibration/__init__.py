"""Calibration of a camera on a robot: its lens, its mount, and the pose of its target."""

from robsim.base.lazy_names import attach_names

__getattr__, __dir__, __all__ = attach_names(__name__, __file__)
