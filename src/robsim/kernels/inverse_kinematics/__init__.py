"""Inverse kinematics by iterative search and in closed form."""
