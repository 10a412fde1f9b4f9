"""The linear loop of an experiment near its goal, the basis of `advise`."""
