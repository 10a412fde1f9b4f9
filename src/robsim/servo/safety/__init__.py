"""The safety of a command: what a robot may be told at most, whatever its law wishes."""
