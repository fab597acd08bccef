// The faces of an object's cylinder, and what the number of an image says, see grids.py.
uniform ivec2 first_images;     // number of the first side image and of the first bottom image
uniform vec4 cylinder;          // radius, bottom, half width, half depth
uniform float cylinder_height;

const int PAST_AXIS = 256;      // flags
const int BORDER = 512;
const float TURN = 6.283185307179586;

int layer_of(int image) { return image & (PAST_AXIS - 1); }
bool on_top(int image) { return layer_of(image) < first_images.x; }
bool on_side(int image) { return !on_top(image) && layer_of(image) < first_images.y; }
