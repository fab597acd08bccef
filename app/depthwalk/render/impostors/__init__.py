"""Schedule impostor tiles: the planes that they are warped on, their layout, and their cache."""
