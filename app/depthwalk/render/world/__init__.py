"""Keep the scene's objects and assets in arrays that last from frame to frame."""
