"""Calibrated cameras in the files and messages of other programs."""
