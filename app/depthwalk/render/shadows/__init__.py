"""Plan shadow maps: what the maps of sun and lamps see, what is drawn into them, and the texture that holds them.

`cascades` and `spot_maps` say what a map of the sun or of a lamp sees, `casters` which objects are drawn into it and
how fine, `shadow_atlas` keeps the maps as tiles of one texture, and `sun_uniforms` hands them to the shaders.
"""
