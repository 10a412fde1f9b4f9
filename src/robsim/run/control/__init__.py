"""The controller of an experiment on its own, for a real robot or another control loop."""
