"""Goals: the values that the features of a task are to reach."""
