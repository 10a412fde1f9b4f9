"""Tasks: servo schemes, trajectories, and tasks made of tasks."""
