"""Tags and boards to print, and detectors of their corners in images: the extra `vision`."""
