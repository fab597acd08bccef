// Places each cell of a finished picture where a camera that has moved sees the nearest surface in it: a rectangle about the
// cell, as far ahead as that surface. Coordinates are those of reprojection.frag.
// Twin: reference/reprojection.py.
//
// MOVED: that of the nearest surface that moves by itself.
#from depthwalk.render.reprojection.nearest_cells import CELL
#from depthwalk.render.reprojection.reprojection import BEYOND, LEAST_AHEAD
uniform sampler2D nearest;          // of each cell, metres; with MOVED its velocity, m/s, and metres
uniform float elapsed;              // with MOVED: seconds since the picture's moment
uniform vec2 picture_size;          // pixels
uniform vec2 half_extent;           // tangents of half the picture's angles
uniform vec3 viewer;                // the new camera
uniform mat3 screen_from_ray;       // takes a point relative to that camera to (x, y, 1) × metres ahead, x and y from −1 to 1
uniform vec2 screen_cells;          // columns and rows of cells on the screen; the last ones may be cut off

flat out float ahead;
flat out vec3 shift;                // by which the surface has moved itself, metres

const vec4 NOWHERE = vec4(2.0, 2.0, 2.0, 1.0);

void main() {
    int columns = textureSize(nearest, 0).x;
    ivec2 cell = ivec2(gl_InstanceID % columns, gl_InstanceID / columns);
    vec4 surface = texelFetch(nearest, cell, 0);
#ifdef MOVED
    float distance = surface.w;
    shift = elapsed * surface.xyz;
#else
    float distance = surface.r;
    shift = vec3(0.0);
#endif
    vec2 low = vec2(1e9), high = vec2(-1e9);
    ahead = 1e9;
    for (int k = 0; k < 4; ++k) {
        vec2 place = vec2(cell + ivec2(k & 1, k >> 1)) * float(CELL) / picture_size;
        vec3 seen = screen_from_ray * (vec3((2.0 * place - 1.0) * half_extent, 1.0) * distance + shift - viewer);
        ahead = min(ahead, seen.z);
        low = min(low, seen.xy / seen.z);
        high = max(high, seen.xy / seen.z);
    }
    if (distance >= BEYOND || ahead < LEAST_AHEAD) {
        gl_Position = NOWHERE;
        return;
    }
    // Also cover cells of the screen that it only touches.
    vec2 corner = mix(low, high, vec2(gl_VertexID & 1, gl_VertexID >> 1));
    vec2 at = (0.5 + 0.5 * corner) * screen_cells + vec2(gl_VertexID & 1, gl_VertexID >> 1) - 0.5;
    gl_Position = vec4(2.0 * at / ceil(screen_cells) - 1.0, 1.0 - 2.0 * LEAST_AHEAD / ahead, 1.0);
}
