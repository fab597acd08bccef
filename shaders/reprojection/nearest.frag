// Keeps how far ahead the nearest surface in and around each cell of a finished picture is, metres.
#from depthwalk.render.reprojection import CELL
#from depthwalk.render.reprojection import REACH
uniform sampler2D distances;

layout(location = 0) out float nearest;

const int STRIDE = 4;       // pixels: things narrower than that may be overlooked

void main() {
    ivec2 first = ivec2(gl_FragCoord.xy) * CELL - REACH, last = textureSize(distances, 0) - 1;
    nearest = texelFetch(distances, clamp(first + REACH, ivec2(0), last), 0).r;
    for (int y = STRIDE / 2; y < CELL + 2 * REACH; y += STRIDE)
        for (int x = STRIDE / 2; x < CELL + 2 * REACH; x += STRIDE)
            nearest = min(nearest, texelFetch(distances, clamp(first + ivec2(x, y), ivec2(0), last), 0).r);
}
