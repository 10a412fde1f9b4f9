"""From features to commands: laws, weights, limits, trajectories."""
