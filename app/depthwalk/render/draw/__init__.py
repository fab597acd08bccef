"""Plans of a frame: which objects are drawn, how finely, in which draw calls."""
