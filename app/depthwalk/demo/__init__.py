"""Generators of the demo's own meshes and textures; `python -m depthwalk.demo OUTDIR` runs them all."""
