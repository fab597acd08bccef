// Computes where the depth images of an object show a point of its surface, in the object frame: on the cylinder's side, its caps
// and the sides of the box about it (Liu, Liu and Wu 2007, §3.1). An image is numbered by face and layer, with flags above.
#include "common/depth_object.glsl"
#from depthwalk.bake.images import Face
#from depthwalk.cook.lod_geometry import FACE_SHIFT, PAST_AXIS

const float TURN = 6.283185307179586;
const int PER_FACE = 1 << FACE_SHIFT;   // the bits below hold the layer, the same number above them the face

int face_of(int image) { return image >> FACE_SHIFT & PER_FACE - 1; }
int number_of(int image) { return first_images[face_of(image)] + (image & PER_FACE - 1); }
bool past_axis(int image) { return (image & PAST_AXIS) != 0; }

vec3 box_extent() { return vec3(2.0 * cylinder.z, cylinder_height, 2.0 * cylinder.w); }

// The greatest depth behind a face, metres.
float max_depth(int face) {
    vec3 extent = box_extent();
    return face == FACE_SIDE ? 2.0 * cylinder.x : face <= FACE_BOTTOM ? extent.y : face <= FACE_BACK ? extent.z : extent.x;
}

// The flat face at which somebody looks along `view`.
int face_seen_along(vec3 view) {
    vec3 along = abs(view);
    if (along.y >= max(along.x, along.z)) return view.y < 0.0 ? FACE_TOP : FACE_BOTTOM;
    return along.z >= along.x ? (view.z < 0.0 ? FACE_FRONT : FACE_BACK) : view.x < 0.0 ? FACE_RIGHT : FACE_LEFT;
}

// The place of the surface point p on a flat face: u, v in [0, 1], depth in metres.
vec3 flat_position(vec3 p, int face) {
    vec3 extent = box_extent();
    vec3 at = vec3(p.x / extent.x + 0.5, (p.y - cylinder.y) / extent.y, p.z / extent.z + 0.5);
    vec3 depth = (face == FACE_TOP || face == FACE_FRONT || face == FACE_RIGHT ? 1.0 - at : at) * extent;
    return face <= FACE_BOTTOM ? vec3(at.xz, depth.y) : face <= FACE_BACK ? vec3(at.xy, depth.z) : vec3(at.zy, depth.x);
}

// The same in its image, whose face may be the side (θ is in [−½, ½] turns: the image repeats).
vec3 image_position(vec3 p, int image) {
    if (face_of(image) != FACE_SIDE) return flat_position(p, face_of(image));
    vec2 outward = past_axis(image) ? -p.xz : p.xz;
    float radial = length(p.xz);
    float depth = cylinder.x - (past_axis(image) ? -radial : radial);
    float angle = atan(outward.y, radial > 0.0 ? outward.x : 1.0);      // GLSL leaves atan(0, 0) undefined
    return vec3(angle / TURN, (p.y - cylinder.y) / box_extent().y, depth);
}

// From the surface to the face that sees p, unit.
vec3 face_outward(vec3 p, int image) {
    int face = face_of(image);
    if (face == FACE_SIDE) {
        vec2 axis = p.xz / max(length(p.xz), 1e-6);
        return past_axis(image) ? vec3(-axis.x, 0.0, -axis.y) : vec3(axis.x, 0.0, axis.y);
    }
    if (face <= FACE_BOTTOM) return vec3(0.0, face == FACE_TOP ? 1.0 : -1.0, 0.0);
    if (face <= FACE_BACK) return vec3(0.0, 0.0, face == FACE_FRONT ? 1.0 : -1.0);
    return vec3(face == FACE_RIGHT ? 1.0 : -1.0, 0.0, 0.0);
}
