"""Provide the assets of a scene: find their depth images, or bake them and let the cache keep them.

`library` does so for a scene as its assets are asked for, `background` beside the frames of a walk, `batch_bake` for
many meshes at a time in processes of their own. `demand` says what a scene needs of its assets, and `asset_files` reads
what an asset is made of and derives the keys under which results are kept.
"""
