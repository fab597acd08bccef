"""Show a finished frame through a newer camera, with what earlier frames saw around the viewer.

`reprojection` does so: `smooth_tiles` tells it where it may interpolate, `surround` holds what lies beyond the frame.
`depth_picture` and `picture_cells` are the pictures from which both draw. The shaders are in `shaders/reprojection`.
"""
