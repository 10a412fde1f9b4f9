"""What every room builds on: arrays, errors, names, units and values."""
