"""Robots: joints, links, the kinematic tree, Denavit-Hartenberg tables and tools."""
