"""Define the size of the cells of a finished picture, for which the nearest surface is known."""

CELL = 16  # pixels along the side of a cell
STRIDE = 2  # pixels between those of a cell that are sampled for the nearest surface; narrower things may be missed
MOVING_STRIDE = 4  # the same for surfaces that move by themselves
