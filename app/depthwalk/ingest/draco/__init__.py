"""Decode meshes that Draco has compressed.

DracoPy, which does it, is an extra of this package, `depthwalk[draco]`. It is imported in a process of its own alone.
"""
