"""Measure the quality of pictures, for the commands `compare`, `quality`, `bake --verify` and `bench`.

Depth images are compared with meshes; anti-aliasing, depth of field and shadows with reference pictures that take much
longer to draw.
"""
