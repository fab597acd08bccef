// Covers the places of a finished picture where a moving object's cylinder may be with a rectangle. Coordinates are those of
// search.glsl.
#include "common/records.glsl"
#from depthwalk.render.reprojection.moving_surfaces import MOVING_RECORD
uniform sampler2D objects;      // MOVING_RECORD
uniform vec2 half_extent;       // tangents of half the picture's angles

flat out vec4 centre, axis, velocity, turn;

vec4 of_object(int part) { return record_part(objects, MOVING_RECORD_TEXELS, gl_InstanceID, part); }

void main() {
    centre = of_object(MOVING_RECORD_CENTRE);
    axis = of_object(MOVING_RECORD_AXIS);
    velocity = of_object(MOVING_RECORD_VELOCITY);
    turn = of_object(MOVING_RECORD_TURN);
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
