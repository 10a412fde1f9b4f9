// The experiments to choose from.
