"""The controller of an experiment on its own, for a robot or a loop of one's own."""
