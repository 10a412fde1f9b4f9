"""Goals: the desired values of the features of a task."""
