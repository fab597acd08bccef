"""Choose levels of detail, and meshes in place of depth images: near by, and where they are quicker.

`selection` chooses levels of depth images, `paper_lod` by the paper's rules, `mesh_lod` levels of meshes,
`cluster_selection` mesh clusters. Where meshes replace depth images `mesh_choice` decides by the `fallback_rule`, from
the table `mesh_fallback`.
"""
