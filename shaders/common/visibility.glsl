// Packs what is in front at a pixel into the visibility buffer (Burns and Hunt 2013), and unpacks it: an object and its image,
// and 1 over the distance along the view axis, for which a depth buffer of 24 bits is too coarse.
#from depthwalk.cook.lod_geometry import IMAGE_BITS
#from depthwalk.render.resources.placed_records import COVERAGE_STEPS, FIRST_CAPTURED
const uint COVERAGE_MASK = uint(COVERAGE_STEPS);
const uint COVERAGE_BITS = 4u, PARTIAL_MASK = (1u << (COVERAGE_BITS + 4u)) - 1u, WHOLE = 15u;
const float PARTS = 12.0;
const uvec2 NO_OBJECT = uvec2(0u);     // polygons; depth-image objects are numbered from 1
const uvec2 GROUND = uvec2(0u, COVERAGE_MASK + 1u);     // told apart only to count what shows objects; infinitely far, as NO_OBJECT

uvec2 visibility_from(uint object, uint image, float inverse, float uncovered, vec2 aside) {
    uint part = uint(uncovered * PARTS + 0.5);
    if (part == 0u && aside != vec2(0.0)) part = WHOLE;
    uvec2 place = uvec2(clamp(aside * 4.0 + 2.5, 0.0, 3.0));
    uint low = part > 0u ? place.x << COVERAGE_BITS | place.y << (COVERAGE_BITS + 2u) | part : 0u;
    return uvec2(object << IMAGE_BITS | image, (floatBitsToUint(inverse) & ~(part > 0u ? PARTIAL_MASK : COVERAGE_MASK)) | low);
}
uvec2 visibility_from(uint object, uint image, float inverse) {
    return uvec2(object << IMAGE_BITS | image, floatBitsToUint(inverse) & ~COVERAGE_MASK);
}
// As polygons, but tells which row of the scene's objects a captured view shows.
uvec2 captured_visibility(uint row) { return uvec2(0u, uint(FIRST_CAPTURED) + row * (COVERAGE_MASK + 1u)); }
uint object_of(uvec2 visibility) { return visibility.x >> IMAGE_BITS; }
int image_of(uvec2 visibility) { return int(visibility.x & ((1u << IMAGE_BITS) - 1u)); }
bool has_aside(uvec2 visibility) { return (visibility.y & COVERAGE_MASK) != 0u; }
float distance_of(uvec2 visibility) {
    return 1.0 / uintBitsToFloat(visibility.y & ~(has_aside(visibility) ? PARTIAL_MASK : COVERAGE_MASK));
}
float uncovered_of(uvec2 visibility) {
    uint part = visibility.y & COVERAGE_MASK;
    return part == WHOLE ? 0.0 : float(part) / PARTS;
}
// Where the middle of the covered part lies, pixels from the pixel's middle.
vec2 covered_middle(uvec2 visibility) {
    if (!has_aside(visibility)) return vec2(0.0);
    return vec2(visibility.y >> COVERAGE_BITS & 3u, visibility.y >> (COVERAGE_BITS + 2u) & 3u) / 4.0 - 0.5;
}
