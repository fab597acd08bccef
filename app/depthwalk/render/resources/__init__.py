"""Keep assets on the GPU, and own their GL objects.

`asset_store` decides what is loaded and what gives way, and `mesh_store` does so for meshes. `depth_image_object` and
`mesh_object` are what one asset is on the GPU, `meshlets` the patches in which a mesh is culled, and `placed_records`
what a shader reads per object.
"""
