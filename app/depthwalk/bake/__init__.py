"""Bake a mesh to depth images: sample its surface, connect the samples, choose owners, and keep the result in a file.

Meshes come from `ingest`; what is baked goes on to `cook`. `baker.bake_object` is the outline.
"""
