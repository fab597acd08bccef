"""Compute with arrays of vectors, quaternions, triangles and edges, and order points in space; no GL and no files."""
