"""Estimation of poses, depths and robust weights from images."""
