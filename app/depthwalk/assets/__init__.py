"""Provide the assets of a scene: find their depth images, or bake them and store them in the cache.

`library` does so for a scene when its assets are requested, `background` in the background of a walk, `batch_bake` for
many meshes at a time in separate processes. `demand` determines what a scene needs of its assets, and `asset_files`
reads an asset's files and derives the keys under which results are stored.
"""
