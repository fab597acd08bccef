// Looks colours up in an object's own texture, at coordinates that its depth images hold (`DepthImage.coordinates`), where that
// is finer than a colour per texel. Twin: reference/texture_coordinates.py.
#from depthwalk.bake.images import COORDINATE_STEPS, HAS_COORDINATES, ONE_CHART
#from depthwalk.cook.virtual_texture import FLATTEST
uniform usampler2D page_coordinates;    // u and v, with a mark in the last bit of each, where the pages have the texel
uniform sampler2D base_texture;

// From the viewer to the point that is looked up, object frame, metres, and its change by a pixel to the right, and upward.
vec3 sight, sight_right, sight_up;

// Texels of an image that a pixel covers, beyond which the finest mip tier is not looked up and stored colours are used.
const float FINEST_END = float(2 << MIP_TIER_LEVELS);

vec2 coordinates_of(uvec2 code) { return vec2(code & ~1u) / float(COORDINATE_STEPS); }

// The difference of two coordinates of a texture that repeats.
vec2 shortest(vec2 difference) { return fract(difference + 0.5) - 0.5; }

// How far a point p of an image moves within the image, in parts of its size, when it moves by `change`.
vec2 moved_within(vec3 p, int face, vec3 change) {
    vec3 part = change / box_extent();
    if (face == FACE_SIDE) return vec2((p.x * change.z - p.z * change.x) / (TURN * max(dot(p.xz, p.xz), 1e-12)), part.y);
    return face <= FACE_BOTTOM ? part.xz : face <= FACE_BACK ? part.xy : part.zy;
}

// The same for a step of a pixel, which moves the ray by `change` to another point of the surface's tangent plane at p.
vec2 step_within(vec3 p, int face, vec3 normal, vec3 change) {
    float facing = min(dot(normal, sight), -FLATTEST * length(sight));
    return moved_within(p, face, change - sight * (dot(normal, change) / facing));
}

// Returns whether there are coordinates at a place of the pages, level 0; if so, writes them to `at`, and their change from
// texel to texel, to the right and upward, to `slope`. border: whether the four texels may show several surfaces.
bool coordinates_at(vec2 place, Around around, bool border, out vec2 at, out mat2 slope) {
    vec2 f = fract(place - 0.5);
    uvec2 code[4];
    for (int k = 0; k < 4; ++k) code[k] = texelFetch(page_coordinates, around.at[k], 0).xy;
    if (!border && (code[0].y & uint(ONE_CHART)) != 0u) {
        vec2 low = coordinates_of(code[0]), right = shortest(coordinates_of(code[1]) - low);
        vec2 above = shortest(coordinates_of(code[2]) - low), bend = shortest(coordinates_of(code[3]) - low) - right - above;
        at = low + f.x * right + f.y * above + f.x * f.y * bend;
        slope = mat2(right + f.y * bend, above + f.x * bend);
        return true;
    }
    // Beside a seam or an edge: start from the texel of the greatest weight, and extrapolate with the slope of its own chart.
    // If that has no coordinates, the surface has none: those of the others are another one's.
    int most = 0;
    for (int k = 1; k < 4; ++k) {
        if (around.weight[k] > around.weight[most]) most = k;
    }
    ivec2 corner = ivec2(most & 1, most >> 1), outward = 2 * corner - 1, middle = around.at[most];
    vec2 own = coordinates_of(code[most]);
    bool goes_on = (texelFetch(page_coordinates, middle + corner - 1, 0).y & uint(ONE_CHART)) != 0u;
    vec2 beside = coordinates_of(texelFetch(page_coordinates, middle + ivec2(outward.x, 0), 0).xy);
    vec2 above = coordinates_of(texelFetch(page_coordinates, middle + ivec2(0, outward.y), 0).xy);
    slope = goes_on ? mat2(shortest(beside - own) * float(outward.x), shortest(above - own) * float(outward.y)) : mat2(0.0);
    at = own + slope * (f - vec2(corner));
    return (code[most].x & uint(HAS_COORDINATES)) != 0u;
}

// Returns the linear colour at a place of the pages, level 0. stored: the linear colour that they hold there; right, up: the
// step of a pixel, texels; covered: texels that a pixel covers; other parameters as for `coordinates_at`.
vec3 painted(vec2 place, Around around, vec3 stored, bool border, vec2 right, vec2 up, float covered) {
    vec2 at;
    mat2 slope;
    bool has = coordinates_at(place, around, border, at, slope);
    vec3 found = textureGrad(base_texture, at, slope * right, slope * up).rgb;
    return has ? mix(stored, found, clamp(log2(FINEST_END / covered), 0.0, 1.0)) : stored;
}
