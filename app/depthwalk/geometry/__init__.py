"""Geometry over arrays: vectors, quaternions, triangles, edges and orders in space; no GL and no files."""
