"""The page that shows runs, scenes and robots in a browser."""
