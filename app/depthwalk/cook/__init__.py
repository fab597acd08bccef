"""Cooking: from depth images to the arrays that the GPU reads; no GL and no viewer. `cook.cook` is its outline."""
