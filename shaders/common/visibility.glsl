// Packs the front surface of a pixel into the visibility buffer (Burns and Hunt 2013), and unpacks it: an object and its image,
// and 1 over the distance along the view axis, for which a depth buffer of 24 bits is too coarse.
#from depthwalk.cook.lod_geometry import IMAGE_BITS
#from depthwalk.render.resources.placed_records import COVERAGE_BITS, FIRST_CAPTURED
const uint COVERAGE_MASK = (1u << COVERAGE_BITS) - 1u;
const uint ASIDE_MASK = 3u, ASIDE_BITS = 2u, PART_MASK = (1u << (uint(COVERAGE_BITS) + 2u * ASIDE_BITS)) - 1u;
const uint COVERAGE_STEPS = 12u;           // whole numbers of four texels are exact
const uint COVERED_ASIDE = COVERAGE_MASK;      // instead: the whole pixel is covered, but its distance is that of a point aside
const uvec2 NO_OBJECT = uvec2(0u);     // polygons; depth-image objects are numbered from 1
const uvec2 GROUND = uvec2(0u, COVERAGE_MASK + 1u);     // as NO_OBJECT, but not counted as a pixel of objects

// What fills the pixel. `inverse` is good to 1e-6.
uvec2 visibility_from(uint object, uint image, float inverse) {
    return uvec2(object << IMAGE_BITS | image, floatBitsToUint(inverse) & ~COVERAGE_MASK);
}
// What fills the pixel except for the part `uncovered`, with its distance taken not at the pixel's centre but `aside` from it,
// pixels, −½ to ¼ along either axis, in steps of a quarter. These take further bits, and `inverse` is good to 1.5e-5.
uvec2 visibility_from(uint object, uint image, float inverse, float uncovered, vec2 aside) {
    uint part = uint(uncovered * float(COVERAGE_STEPS) + 0.5);
    if (part == 0u) {
        if (aside == vec2(0.0)) return visibility_from(object, image, inverse);
        part = COVERED_ASIDE;
    }
    uvec2 place = uvec2(clamp(aside * 4.0 + 2.5, 0.0, float(ASIDE_MASK)));
    part |= place.x << COVERAGE_BITS | place.y << (uint(COVERAGE_BITS) + ASIDE_BITS);
    return uvec2(object << IMAGE_BITS | image, (floatBitsToUint(inverse) & ~PART_MASK) | part);
}
// As polygons, but with the row of the scene's object that a captured view shows.
uvec2 captured_visibility(uint row) { return uvec2(0u, uint(FIRST_CAPTURED) + row * (COVERAGE_MASK + 1u)); }
// As polygons, but with the number of their record and how they are drawn, NUMBERED_MESH or NUMBERED_CLUSTERS.
uvec2 numbered_visibility(uint how, uint number) { return uvec2(how, number * (COVERAGE_MASK + 1u)); }
uint number_of(uvec2 visibility) { return visibility.y / (COVERAGE_MASK + 1u); }
bool is_captured(uvec2 visibility) { return visibility.x == 0u && visibility.y >= uint(FIRST_CAPTURED); }
uint object_of(uvec2 visibility) { return visibility.x >> IMAGE_BITS; }
int image_of(uvec2 visibility) { return int(visibility.x & ((1u << IMAGE_BITS) - 1u)); }
// Whether the whole pixel is covered, with the distance of its centre.
bool is_plain(uvec2 visibility) { return (visibility.y & COVERAGE_MASK) == 0u; }
float distance_of(uvec2 visibility) {
    return 1.0 / uintBitsToFloat(visibility.y & ~(is_plain(visibility) ? COVERAGE_MASK : PART_MASK));
}
float uncovered_of(uvec2 visibility) {
    uint part = visibility.y & COVERAGE_MASK;
    return part == COVERED_ASIDE ? 0.0 : float(part) / float(COVERAGE_STEPS);
}
vec2 aside_of(uvec2 visibility) {
    if (is_plain(visibility)) return vec2(0.0);
    return vec2(visibility.y >> COVERAGE_BITS & ASIDE_MASK, visibility.y >> (uint(COVERAGE_BITS) + ASIDE_BITS) & ASIDE_MASK) / 4.0 - 0.5;
}
