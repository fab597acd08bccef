// Computes where the depth images of an object show a point of its surface, in the object frame: on the cylinder's side, its caps
// and the sides of the box about it (Liu, Liu and Wu 2007, §3.1). An image is numbered by face and layer, with flags above.
#from depthwalk.bake.images import FACE_COUNT, Face
#from depthwalk.cook.lod_geometry import FACE_SHIFT, PAST_AXIS
uniform int first_images[FACE_COUNT];   // number of each face's first image
uniform vec4 cylinder;                  // radius, bottom, half width, half depth
uniform float cylinder_height;

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

// The place of the surface point p in its image: u, v in [0, 1] (θ is in [−½, ½] turns: the image repeats), depth in metres.
vec3 image_position(vec3 p, int image) {
    int face = face_of(image);
    vec3 extent = box_extent();
    vec3 at = vec3(p.x / extent.x + 0.5, (p.y - cylinder.y) / extent.y, p.z / extent.z + 0.5);
    if (face == FACE_SIDE) {
        vec2 outward = past_axis(image) ? -p.xz : p.xz;
        float radial = length(p.xz);
        float depth = cylinder.x - (past_axis(image) ? -radial : radial);
        return vec3(atan(outward.y, radial > 0.0 ? outward.x : 1.0) / TURN, at.y, depth);     // GLSL leaves atan(0, 0) undefined
    }
    if (face <= FACE_BOTTOM) return vec3(at.xz, (face == FACE_TOP ? 1.0 - at.y : at.y) * extent.y);
    if (face <= FACE_BACK) return vec3(at.xy, (face == FACE_FRONT ? 1.0 - at.z : at.z) * extent.z);
    return vec3(at.zy, (face == FACE_RIGHT ? 1.0 - at.x : at.x) * extent.x);
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
