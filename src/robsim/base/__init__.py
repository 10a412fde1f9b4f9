"""The modules that all others build on: arrays, errors, names, units and values."""
