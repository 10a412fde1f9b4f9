"""Trajectories of joints or of a frame over time, from rest to rest."""

from robsim.base.lazy_names import attach_names

__getattr__, __dir__ = attach_names(__name__, __file__)
