"""The compiled formulas, each written once, over float64 arrays whose last index is the run.

Single letters: b the run, i body or point, j joint velocity, k feature, r and c row and column.
`T[3, 4, b]` is a pose (top three rows), `M[i, 3, 4, b]` the moving bodies of a tree (0 is the
world), `q[n, b]` coordinates, `J[6, j, b]` a Jacobian with rows (v, omega), `L[k, 6, b]` an
interaction matrix. Outputs come last. Nothing here knows a class of ours.
"""
