"""Inverse kinematics: by iteration and in closed form."""
