"""depthwalk: walk through scenes too heavy to draw, by depth images warped on the GPU."""

__version__ = "0.1.0"
