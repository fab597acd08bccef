// Looks colours up in an object's own texture, at coordinates that its depth images hold (`DepthImage.coordinates`), where
// that is finer than a colour per texel. Twin: reference/texture_coordinates.py.
#from depthwalk.bake.texture_coordinates import HAS_COORDINATES, ONE_CHART, STEPS as COORDINATE_STEPS
uniform usampler2D page_coordinates;    // u and v, with a mark in the last bit of each, where the pages have the texel
uniform sampler2D base_texture;

// From the viewer to the point that is looked up, object frame, metres; how that changes by a pixel to the right, and upward.
vec3 sight, sight_right, sight_up;

const float FLATTEST = 0.08;            // cosine between a ray and the surface's normal, below which blur grows no more
const float FINEST_END = 4.0;           // texels of an image that a pixel covers, from which on its stored colours serve

vec2 coordinates_of(uvec2 code) { return vec2(code & ~1u) / float(COORDINATE_STEPS); }

// The difference of coordinates that are 1 apart from the texture's repetition to the next.
vec2 shortest(vec2 difference) { return fract(difference + 0.5) - 0.5; }

// How far a point p of an image moves within it, in parts of its size, when the point moves by `change`.
vec2 moved_within(vec3 p, int face, vec3 change) {
    vec3 part = change / box_extent();
    if (face == FACE_SIDE) return vec2((p.x * change.z - p.z * change.x) / (TURN * max(dot(p.xz, p.xz), 1e-12)), part.y);
    return face <= FACE_BOTTOM ? part.xz : face <= FACE_BACK ? part.xy : part.zy;
}

// The same by a pixel's step, which takes the ray by `change` to another point of the plane that touches the surface at p.
vec2 step_within(vec3 p, int face, vec3 normal, vec3 change) {
    float facing = min(dot(normal, sight), -FLATTEST * length(sight));
    return moved_within(p, face, change - sight * (dot(normal, change) / facing));
}

// Returns the linear colour at a place of the pages, level 0. stored: the linear colour that they hold there, `blended` of whole
// texels already or half as sharp; right, up: what a pixel's step is, texels; covered: texels that a pixel covers.
vec3 painted(vec2 place, vec3 stored, bool blended, vec2 right, vec2 up, float covered) {
    if (covered >= FINEST_END) return stored;
    ivec2 low = ivec2(floor(place - 0.5));
    vec2 f = place - 0.5 - vec2(low);
    uvec2 code[4];
    for (int k = 0; k < 4; ++k) code[k] = texelFetch(page_coordinates, low + ivec2(k & 1, k >> 1), 0).xy;
    vec2 first = coordinates_of(code[0]);
    vec3 found = vec3(0.0);
    if ((code[0].y & uint(ONE_CHART)) != 0u) {
        vec2 along = shortest(coordinates_of(code[1]) - first), upward = shortest(coordinates_of(code[2]) - first);
        vec2 bend = shortest(coordinates_of(code[3]) - first) - along - upward;
        vec2 at = first + f.x * along + f.y * upward + f.x * f.y * bend;
        mat2 slope = mat2(along + f.y * bend, upward + f.x * bend);
        found = textureGrad(base_texture, at, slope * right, slope * up).rgb;
    } else if (!blended && (code[0].x & code[1].x & code[2].x & code[3].x & uint(HAS_COORDINATES)) != 0u) {
        // Across a seam: a blend of the colours at the four texels, as images without coordinates hold them.
        vec4 near = vec4((1.0 - f.x) * (1.0 - f.y), f.x * (1.0 - f.y), (1.0 - f.x) * f.y, f.x * f.y);
        for (int k = 0; k < 4; ++k) found += near[k] * textureLod(base_texture, coordinates_of(code[k]), 0.0).rgb;
    } else {
        return stored;
    }
    return mix(stored, found, clamp(log2(FINEST_END / covered), 0.0, 1.0));
}
