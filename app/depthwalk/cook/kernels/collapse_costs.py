"""Define what the collapse of an edge costs in mesh clusters, for NumPy and for the compiled loops.

The constants are in this folder, since numba compiles them into the loops, which are compiled again when a file of this
folder changes.
"""

NORMAL = 0.001  # distance, relative to the mesh's size, that a difference of 1 between normals counts as
SEAM = 0.01  # the same for the loss of a seam
SHORT = 1e-4  # part of an edge's squared length that is added to its cost: in flat areas, short edges go first
COLOUR = 4.0  # times the edges of a triangle is the distance that a difference of 1 between colours counts as
STIFFNESS = 1e-3  # of a surface's weight: pulls a vertex to its edge's midpoint where planes leave it free
STEEP = 100.0  # times what a group's collapses cost half-way: if its cheapest costs more, it keeps its triangles
TURN = 0.25  # cosine: a triangle that turns further than that has flipped
