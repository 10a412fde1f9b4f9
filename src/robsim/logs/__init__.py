"""Logs of runs and robots: ROS 2 bags, CSV and Parquet tables, data frames."""

from robsim.base.lazy_names import attach_names

__getattr__, __dir__, __all__ = attach_names(__name__, __file__)
