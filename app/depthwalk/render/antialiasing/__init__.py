"""Which anti-aliasing a picture gets, and the lines that geometric anti-aliasing draws."""
