"""Projection of marks into images, and noise, occlusion and delay of images."""
