"""Decode meshes that Draco has compressed.

DracoPy, which does it, is of the extra `depthwalk[gltf]`. It is imported in a process of its own alone.
"""
