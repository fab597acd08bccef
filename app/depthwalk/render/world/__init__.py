"""Keep the scene's objects and assets in arrays that last from frame to frame.

`render_world` turns a scene into these arrays, `asset_table` describes its assets, `spatial_cells` and `far_clusters`
group neighbouring objects, `placeholders` shows something while depth images are still loading, and `frame_residency`
uploads what a frame needs.
"""
