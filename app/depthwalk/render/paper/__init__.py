"""Draw as the papers do, where the renderer itself does otherwise, for comparison."""
