// The list of keys.
