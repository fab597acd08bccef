"""Choose levels of detail, and meshes in place of depth images: near by, and where they are quicker.

`selection` chooses levels of depth images, `paper_lod` by the paper's rules, `mesh_lod` levels of meshes,
`cluster_selection` mesh clusters; `mesh_choice` decides where meshes replace depth images, from `mesh_fallback`.
"""
