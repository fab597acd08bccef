"""Plan a frame: which objects are drawn, how finely, and in which draw calls."""
