"""Read the files by which modelling programs exchange scenes: FBX, COLLADA, 3D Studio and 3MF.

A module per format turns a file into a `model.Model`, polygons with names of materials; `reader` makes triangles of it.
All of it is Python and NumPy: no library that reads these formats holds what docs/promises.md says of damaged files.
"""
