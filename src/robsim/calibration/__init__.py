"""Calibration of a camera on a robot: its lens, its mount, and where its target stands."""
