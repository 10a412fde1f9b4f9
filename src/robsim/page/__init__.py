"""The page that shows runs, scenes and robots in a browser: recordings of them, and what draws them."""
