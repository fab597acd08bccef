"""Compute the light of a scene for the shaders.

`sky` models the radiance of the sky by direction and the sun's colour, `irradiance` the light that surfaces receive
from both, and `light_clusters` lists the lamps that reach each part of the view.
"""
