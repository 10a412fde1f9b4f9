"""Calibration of a camera on a robot: lens, mount, and pose of the calibration target."""

from robsim.base.lazy_names import attach_names

__getattr__, __dir__ = attach_names(__name__, __file__)
