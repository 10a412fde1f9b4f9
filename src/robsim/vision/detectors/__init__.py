"""Detectors of marks in pictures."""
