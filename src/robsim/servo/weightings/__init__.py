"""Weightings, which make a mark count less than others in a servo task; one file each."""
