"""What a run or a task is like: compared, diagnosed, explained, and where its equilibria are."""
