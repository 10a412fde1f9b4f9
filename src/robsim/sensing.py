"""How the image that a controller gets differs from the one that there is."""
