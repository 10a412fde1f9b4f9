"""Constraints on the command of a law: limits of joints, the field of view, space."""
