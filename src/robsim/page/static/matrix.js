// The interaction matrix of an instant.
