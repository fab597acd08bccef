"""Measure how good pictures are: depth images against meshes, and each mechanism against the truth."""
