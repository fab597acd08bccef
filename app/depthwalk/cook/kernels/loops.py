"""Collect the compiled functions; importing this module compiles them, or reads them from the cache."""

from depthwalk.cook.kernels.collapse_loops import collapse
from depthwalk.cook.kernels.distance_loops import nearest
from depthwalk.cook.kernels.division_loops import divide

__all__ = ["collapse", "divide", "nearest"]
