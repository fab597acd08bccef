"""Bake a mesh to depth images: sample its surface, connect the samples, choose owners, and store the result in a file.

Meshes come from `ingest`; the baked result is processed further by `cook`. Start reading at `baker.bake_object`.
"""
