"""Laws, goals and tasks: the path from features to joint velocities."""
