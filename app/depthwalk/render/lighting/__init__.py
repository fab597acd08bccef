"""Derive the light of a scene as the shaders take it.

`sky` gives the radiance of the sky by direction and the sun's colour, `irradiance` what surfaces receive of it, and
`light_clusters` the lamps that reach each part of the view.
"""
