"""Impostor tiles: the planes they are warped on, their layout, cache and schedule."""
