// Writes how fast a surface moves that lies within a moving object's cylinder, as a part of that rigid body. Twin:
// reference/finished_picture.py.
#from depthwalk.render.reprojection.moving_surfaces import BASE, GROWN
uniform sampler2D distances;    // metres ahead, of either sign
uniform vec2 half_extent;       // tangents of half the picture's angles

flat in vec4 centre;    // metres; w: half the height
flat in vec4 axis;      // unit; w: the radius
flat in vec4 velocity;  // at the camera, m/s; w: growth, 1/s
flat in vec4 turn;      // radians per second
layout(location = 0) out vec4 moves;    // m/s; w: 1

void main() {
    vec2 screen = gl_FragCoord.xy / vec2(textureSize(distances, 0)) * 2.0 - 1.0;
    vec3 point = vec3(screen * half_extent, 1.0) * abs(texelFetch(distances, ivec2(gl_FragCoord.xy), 0).r);
    vec3 from_centre = point - centre.xyz;
    float along = dot(from_centre, axis.xyz), off = length(from_centre - along * axis.xyz);
    if (off > GROWN * axis.w || along > GROWN * centre.w || along < (2.0 * BASE - 1.0) * centre.w) discard;
    moves = vec4(velocity.xyz + cross(turn.xyz, point) + velocity.w * point, 1.0);
}
