// What is in front at a pixel, before it is shaded: an image of an object, and 1 over the distance along the view axis, for
// which a depth buffer of 24 bits is too coarse. Numbers of images take 10 bits.
const int IMAGE_BITS = 10;
const uvec2 NO_OBJECT = uvec2(0u);     // polygons; objects count from 1

uvec2 visible_from(uint object, uint image, float inverse) {
    return uvec2(object << IMAGE_BITS | image, floatBitsToUint(inverse));
}
uint object_of(uvec2 visible) { return visible.x >> IMAGE_BITS; }
int image_of(uvec2 visible) { return int(visible.x & ((1u << IMAGE_BITS) - 1u)); }
float distance_of(uvec2 visible) { return 1.0 / uintBitsToFloat(visible.y); }
