"""The suites of RobSim: each module has a function `suite`."""
