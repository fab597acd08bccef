// What is in front at a pixel, before it is shaded: an image of an object, and 1 over the distance along the view axis, for
// which a depth buffer of 24 bits is too coarse. Numbers of images take 10 bits.
const int IMAGE_BITS = 10;
const uint OPEN = 15u;
const uvec2 NO_OBJECT = uvec2(0u);     // polygons; objects count from 1

// open: the part of the pixel that shows what is behind. It takes the last bits of `inverse`, which is good to 1e-6 without.
uvec2 visible_from(uint object, uint image, float inverse, float open) {
    return uvec2(object << IMAGE_BITS | image, (floatBitsToUint(inverse) & ~OPEN) | uint(open * float(OPEN) + 0.5));
}
uint object_of(uvec2 visible) { return visible.x >> IMAGE_BITS; }
int image_of(uvec2 visible) { return int(visible.x & ((1u << IMAGE_BITS) - 1u)); }
float distance_of(uvec2 visible) { return 1.0 / uintBitsToFloat(visible.y & ~OPEN); }
float open_of(uvec2 visible) { return float(visible.y & OPEN) / float(OPEN); }
