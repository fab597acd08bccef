"""Schedule impostor tiles: the planes that they are warped on, their layout, and their cache.

`tile_scheduler` decides which tiles are warped and which are reused, `warp_planes` and `tile_placement` where they lie
on planes, `tile_cache` and `atlas_allocator` where in the atlas, `tile_records` writes what the shaders read.
"""
