// The faces that images lie on (bake/images.py), and what a vertex says of its image: face · 8 + layer, with flags
// (render/grids.py).
uniform int first_images[7];    // number of each face's first image
uniform vec4 cylinder;          // radius, bottom, half width, half depth
uniform float cylinder_height;

const int TOP = 0, SIDE = 1, BOTTOM = 2, FRONT = 3, BACK = 4, RIGHT = 5, LEFT = 6;
const int EDGE = 128, PAST_AXIS = 256, BORDER = 512;    // flags
const float TURN = 6.283185307179586;

int face_of(int image) { return image >> 3 & 7; }
int number_of(int image) { return first_images[face_of(image)] + (image & 7); }
bool past_axis(int image) { return (image & PAST_AXIS) != 0; }

vec3 box_extent() { return vec3(2.0 * cylinder.z, cylinder_height, 2.0 * cylinder.w); }

// The greatest depth that a face measures, metres.
float face_reach(int face) {
    vec3 extent = box_extent();
    return face == SIDE ? 2.0 * cylinder.x : face <= BOTTOM ? extent.y : face <= BACK ? extent.z : extent.x;
}

// Where its image has the surface point p: u, v in [0, 1] (θ is in [−½, ½] turns: the image repeats), depth in metres.
vec3 image_position(vec3 p, int image) {
    int face = face_of(image);
    vec3 extent = box_extent();
    vec3 at = vec3(p.x / extent.x + 0.5, (p.y - cylinder.y) / extent.y, p.z / extent.z + 0.5);
    if (face == SIDE) {
        vec2 outward = past_axis(image) ? -p.xz : p.xz;
        float radial = length(p.xz);
        float depth = cylinder.x - (past_axis(image) ? -radial : radial);
        return vec3(atan(outward.y, outward.x) / TURN, at.y, depth);
    }
    if (face <= BOTTOM) return vec3(at.xz, (face == TOP ? 1.0 - at.y : at.y) * extent.y);
    if (face <= BACK) return vec3(at.xy, (face == FRONT ? 1.0 - at.z : at.z) * extent.z);
    return vec3(at.zy, (face == RIGHT ? 1.0 - at.x : at.x) * extent.x);
}

// From the surface to the face that sees p, unit.
vec3 face_outward(vec3 p, int image) {
    int face = face_of(image);
    if (face == SIDE) {
        vec2 axis = p.xz / max(length(p.xz), 1e-6);
        return past_axis(image) ? vec3(-axis.x, 0.0, -axis.y) : vec3(axis.x, 0.0, axis.y);
    }
    if (face <= BOTTOM) return vec3(0.0, face == TOP ? 1.0 : -1.0, 0.0);
    if (face <= BACK) return vec3(0.0, 0.0, face == FRONT ? 1.0 : -1.0);
    return vec3(face == RIGHT ? 1.0 : -1.0, 0.0, 0.0);
}
