"""Keep assets on the GPU, and own their GL objects.

`asset_store` decides what is loaded and what gives way, `texture_streaming` does so for its textures, and `mesh_store`
for meshes, which `mesh_reader` reads. `cooked_parts` numbers what is drawn. `depth_image_object`, `surface_texture` and
`mesh_object` are what one asset is on the GPU, `meshlets` the patches in which a mesh is culled, and `placed_records`
what a shader reads per object.
"""
