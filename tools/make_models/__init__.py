"""Generators of the demo's own meshes and textures; `python -m tools.make_models OUTDIR` runs them all."""
