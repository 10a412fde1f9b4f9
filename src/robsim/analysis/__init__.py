"""Analysis of runs and tasks: comparison, diagnosis, explanation, equilibria and workspaces."""
