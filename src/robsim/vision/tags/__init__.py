"""Tags and boards to print, and detectors that find their corners in images: the extra `vision`."""
