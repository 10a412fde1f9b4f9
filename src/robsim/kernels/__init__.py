"""Compiled formulas over float64 arrays. The last index of an array is the run.

Single letters: b is the run, i a body or point, j a joint velocity, k a feature, r and c row and
column. `T[3, 4, b]` is a pose (its top three rows), `M[i, 3, 4, b]` the moving bodies of a tree (0
is the world), `q[n, b]` coordinates, `J[6, j, b]` a Jacobian with rows (v, omega), `L[k, 6, b]` an
interaction matrix. Outputs come last in a parameter list. Kernels use no class of other rooms of
the package. Each formula is written once.
"""
