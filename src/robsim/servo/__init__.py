"""Laws, goals and tasks: how features become joint velocities."""
