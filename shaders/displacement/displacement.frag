// Writes the owner of a pixel and its distance along the view axis into the visibility buffer.
#include "dmesh/dmesh.frag"
