"""Tasks: servo schemes, trajectories, and compositions of tasks."""
