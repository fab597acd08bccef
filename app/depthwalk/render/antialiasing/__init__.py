"""Choose the anti-aliasing of a picture, and find the lines that geometric anti-aliasing draws."""
