"""Studies: thousands of runs of an experiment in which numbers, choices and starts differ."""
