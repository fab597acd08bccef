// Writes the velocity of the nearest surface that moves in each cell of a finished picture, and its distance ahead, metres.
// Twin: reference/finished_picture.py.
#from depthwalk.render.reprojection.nearest_cells import CELL, MOVING_STRIDE
#from depthwalk.render.reprojection.reprojection import BEYOND
uniform sampler2D distances;
uniform sampler2D velocities;   // of velocity.frag

layout(location = 0) out vec4 nearest;  // m/s; w: metres

void main() {
    ivec2 first = ivec2(gl_FragCoord.xy) * CELL, last = textureSize(distances, 0) - 1;
    nearest = vec4(0.0, 0.0, 0.0, BEYOND);
    for (int y = MOVING_STRIDE / 2; y < CELL; y += MOVING_STRIDE)
        for (int x = MOVING_STRIDE / 2; x < CELL; x += MOVING_STRIDE) {
            ivec2 texel = min(first + ivec2(x, y), last);
            vec4 moves = texelFetch(velocities, texel, 0);
            float ahead = abs(texelFetch(distances, texel, 0).r);
            if (moves.w > 0.0 && ahead < nearest.w) nearest = vec4(moves.xyz, ahead);
        }
}
