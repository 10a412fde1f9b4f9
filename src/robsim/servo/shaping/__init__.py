"""Changes of a command after the law: secondary motions, projections, limits."""
