// Covers the places of a finished picture where a moving object's cylinder may be with a rectangle. Coordinates are those of
// search.glsl.
#from depthwalk.render.reprojection.moving_surfaces import COLUMNS, RECORD
uniform sampler2D objects;      // RECORD texels for each object (render/reprojection/moving_surfaces.py)
uniform vec2 half_extent;       // tangents of half the picture's angles

flat out vec4 centre, axis, velocity, turn;

vec4 record(int number) {
    return texelFetch(objects, ivec2(gl_InstanceID % COLUMNS * RECORD + number, gl_InstanceID / COLUMNS), 0);
}

void main() {
    centre = record(0);
    axis = record(1);
    velocity = record(2);
    turn = record(3);
    // The sphere around the cylinder is no nearer than its front and no wider than its back.
    float radius = length(vec2(centre.w, axis.w)), front = centre.z - radius;
    vec2 low = vec2(-1.0), high = vec2(1.0);
    if (front > 1e-2) {
        vec2 depths = vec2(front, centre.z + radius);
        vec2 left = (centre.xy - radius) / half_extent, right = (centre.xy + radius) / half_extent;
        low = min(left / depths.x, left / depths.y);
        high = max(right / depths.x, right / depths.y);
    }
    gl_Position = centre.z + radius < 0.0 ? vec4(2.0, 2.0, 2.0, 1.0)
                                          : vec4(mix(low, high, vec2(gl_VertexID & 1, gl_VertexID >> 1)), 0.0, 1.0);
}
