"""Cameras in calibration files and messages of OpenCV, ROS, Kalibr and COLMAP."""
