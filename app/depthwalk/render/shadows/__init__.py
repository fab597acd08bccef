"""Plan shadow maps: what the maps of sun and lamps see, what is drawn into them, and the texture that holds them.

`cascades` and `spot_maps` place the maps of the sun and of lamps, `casters` chooses the objects that are drawn into
them, and their detail, `shadow_atlas` keeps the maps as tiles of one texture, `sun_uniforms` hands them to the shaders.
"""
