"""The suites of RobSim, one file each with a function `suite`."""
