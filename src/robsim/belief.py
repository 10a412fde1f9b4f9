"""A scene as somebody believes it who is wrong about it, each mistake by its name."""
