"""Tags and boards to print, and the detector of their corners, with the extra `vision`."""
