"""Calibrated cameras from and to the files and messages of other programs."""
