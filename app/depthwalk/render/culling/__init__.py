"""Occlusion culling against the depth of what is drawn already."""
