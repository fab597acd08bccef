// Writes the owner of a pixel and its distance along the view axis, as triangles between warped samples do.
#include "dmesh/dmesh.frag"
