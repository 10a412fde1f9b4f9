"""Bodies of kinematic trees: where they are, and how coordinates move."""
