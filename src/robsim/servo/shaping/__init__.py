"""What is done to a command after the law: secondary motions, projections, limits."""
