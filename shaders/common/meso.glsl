// Meso-structure: a tiling relief modulates the depth of an object's images before they are warped (Liu et al. 2007,
// §3.4). Depth is measured as the image does: along the radius on the side, straight on the other faces. Twin: reference/meso.py.
#include "common/faces.glsl"
uniform sampler2D meso_relief;  // r = metres inward, gb = its slopes to the tile's right and up
uniform vec2 meso_tile;         // width and height of a tile, metres
uniform float meso_turn;        // tiles round the side
uniform float meso_texels;      // per metre
uniform float meso_height;      // metres; 0 where an object has none

struct Meso {
    float depth;        // metres
    vec3 outward;       // from the surface to the face of its image
    vec3 gradient;      // of the depth over the face, metres per metre
};

// At p, object frame; footprint: metres over which it is averaged.
Meso meso_at(vec3 p, int image, float footprint) {
    Meso meso;
    vec3 right, up;
    vec2 uv;
    float most = meso_height;
    meso.outward = face_outward(p, image);
    if (face_of(image) == SIDE) {
        float radius = past_axis(image) ? -length(p.xz) : length(p.xz);
        radius = abs(radius) < 1e-6 ? 1e-6 : radius;
        vec2 axis = meso.outward.xz;
        right = vec3(axis.y, 0.0, -axis.x) * (meso_turn * meso_tile.x / (TURN * radius));  // seen from outside θ runs left
        up = vec3(0.0, 1.0, 0.0);
        uv = vec2(-atan(axis.y, axis.x) / TURN * meso_turn, p.y / meso_tile.y);
        most = min(most, radius > 0.0 ? 0.5 * radius : cylinder.x + radius);    // what is thin keeps a core
    } else {
        bool cap = face_of(image) <= BOTTOM;
        up = cap ? vec3(0.0, 0.0, -meso.outward.y) : vec3(0.0, 1.0, 0.0);
        right = cross(up, meso.outward);
        uv = vec2(dot(p, right), dot(p, up)) / meso_tile;
        most = min(most, face_reach(face_of(image)) - image_position(p, image).z);  // all surface stays in the cylinder
    }
    vec3 relief = textureLod(meso_relief, uv, log2(max(footprint * meso_texels, 1.0))).rgb;
    meso.depth = clamp(relief.r, 0.0, max(most, 0.0));
    meso.gradient = relief.g * right + relief.b * up;
    return meso;
}
