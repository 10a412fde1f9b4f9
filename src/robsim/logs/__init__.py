"""Logs of other programs: ROS 2 bags and tables, written from runs and read as runs."""
