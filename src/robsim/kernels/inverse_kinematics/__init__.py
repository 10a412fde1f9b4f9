"""Inverse kinematics, by search and in closed form."""
