"""Safety: limits of every command, independent of the task and its law."""
