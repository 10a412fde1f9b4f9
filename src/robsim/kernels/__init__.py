"""Compiled formulas over float64 arrays, with the simulation run as the last axis.

Single letters: b is the run, i a body or point, j a joint velocity, k a feature, r and c row and
column. An array of shape (3, 4, b) is a pose (its top three rows), (i, 3, 4, b) the poses of the
moving bodies of a tree (the first is the world), (n, b) coordinates q, (6, j, b) a Jacobian J with
rows (v, omega), (k, 6, b) an interaction matrix L. Outputs come last in a parameter list. Kernels
use no class from other subpackages. Each formula is written once.
"""
