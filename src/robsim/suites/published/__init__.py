"""The suites that ship with RobSim, one file each, which has a function `suite`."""
