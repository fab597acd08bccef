// Computes meso-structure in the object frame: a tiling relief modulates the depth of an object's images before they are
// warped (Liu, Liu and Wu 2007, §3.4). Twin: reference/meso.py.
//
// One relief is wrapped around the axis and moves every point towards it, whichever image it is in, so that images stay joined.
// Surfaces that face along the axis, or around it, would only slide along themselves. So caps and box faces have a second
// relief, straight below their faces, which fades out where they meet other faces.
#include "common/faces.glsl"
#from depthwalk.bake.meso import SQUARE_LEAST, SQUARE_RANGE, WOUND_MOST, WOUND_RANGE
uniform sampler2D meso_relief;  // r = metres inward, gb = its slopes to the tile's right and up
uniform float meso_fade;        // pixels: relief that covers fewer is not displaced

struct Meso {
    float depth;        // metres
    vec3 outward;       // unit, against which it is measured
    vec3 gradient;      // of the depth, metres per metre
};

// uv: in tiles, along right and up; footprint: metres over which it is averaged.
Meso relief_at(vec2 uv, vec3 right, vec3 up, vec3 outward, float footprint) {
    vec3 relief = textureLod(meso_relief, uv, log2(max(footprint * meso_texels, 1.0))).rgb;
    return Meso(clamp(relief.r, 0.0, meso_height), outward, relief.g * right + relief.b * up);
}

// The distance from the axis at which tiles have their nominal width; they narrow towards the axis.
float even_radius() { return meso_turn * meso_tile.x / TURN; }
// Nearer to the axis the relief becomes shallower in proportion, so that it does not reach the axis.
float shallow_radius() { return max(even_radius() / 3.0, 2.0 * meso_height); }

// The relief around the axis at p, object frame; its depth is the one outside the shallow radius.
Meso wound_at(vec3 p, float footprint) {
    float radius = max(length(p.xz), 1e-6);
    vec2 axis = p.xz / radius;
    vec3 outward = vec3(axis.x, 0.0, axis.y), right = vec3(axis.y, 0.0, -axis.x);   // seen from outside θ runs left
    float narrower = even_radius() / radius;
    float turned = atan(axis.y, axis == vec2(0.0) ? 1.0 : axis.x);      // GLSL leaves atan(0, 0) undefined
    vec2 uv = vec2(-turned / TURN * meso_turn, p.y / meso_tile.y);
    return relief_at(uv, right * narrower, vec3(0.0, 1.0, 0.0), outward, footprint * max(narrower, 1.0));
}

// Within the shallow radius a point is moved in proportion to its distance from the axis. p: the point; depth: `part` of the
// relief's at that point. How far inward it moves,
float wound_in(vec3 p, float depth) { return depth * min(length(p.xz) / shallow_radius(), 1.0); }
// how far outward again, p being the moved point,
float wound_out(vec3 p, float depth) { return depth * min(length(p.xz) / (shallow_radius() - depth), 1.0); }
// and the gradient of that way at p.
vec3 wound_gradient(vec3 p, Meso wound) {
    float deep = length(p.xz) / shallow_radius();
    return deep < 1.0 ? deep * wound.gradient + wound.depth / shallow_radius() * wound.outward : wound.gradient;
}

// Below the face of the image, a cap or a box face.
Meso straight_at(vec3 p, int image, float footprint) {
    vec3 outward = face_outward(p, image);
    vec3 up = outward.y != 0.0 ? vec3(0.0, 0.0, -outward.y) : vec3(0.0, 1.0, 0.0), right = cross(up, outward);
    Meso straight = relief_at(vec2(dot(p, right), dot(p, up)) / meso_tile, right, up, outward, footprint);
    float room = max_depth(face_of(image)) - image_position(p, image).z;    // all surface stays in the cylinder
    straight.depth = min(straight.depth, max(room, 0.0));
    return straight;
}

// Part of the straight relief that a surface takes: all where it faces straight outward, none where it faces away from the axis.
// Twin: bake/meso.py.
float straight_share(vec3 normal, vec3 outward, vec3 from_axis) {
    float square = (dot(normal, outward) - SQUARE_LEAST) / SQUARE_RANGE;
    float wound = (WOUND_MOST - abs(dot(normal, from_axis))) / WOUND_RANGE;
    return clamp(square, 0.0, 1.0) * clamp(wound, 0.0, 1.0);
}

// The part of the depth that applies where a pixel covers `footprint` metres.
float displaced_part(float footprint) { return clamp(meso_height / max(footprint * meso_fade, 1e-9) - 1.0, 0.0, 1.0); }
