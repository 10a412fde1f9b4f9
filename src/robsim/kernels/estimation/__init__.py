"""Estimates from images: poses, depths, robust weights."""
