"""Keep assets on the GPU, and own their GL objects.

`asset_store` decides what is loaded and what is evicted, `texture_streaming` does so for its textures, and `mesh_store`
for meshes, which `mesh_reader` reads. `cooked_parts` numbers the parts of assets. `depth_image_object`,
`surface_texture` and `mesh_object` hold a single asset on the GPU, `meshlets` the patches in which a mesh is culled,
and `placed_records` the record that shaders read per object.
"""
