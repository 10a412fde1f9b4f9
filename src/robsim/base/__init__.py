"""Basic modules: arrays, errors, names, units, values, files and interrupts."""
