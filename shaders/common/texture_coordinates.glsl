// Looks colours up in an object's own texture, at coordinates that its depth images hold (`DepthImage.coordinates`), where
// that is finer than a colour per texel. Twin: reference/texture_coordinates.py.
#from depthwalk.bake.texture_coordinates import HAS_COORDINATES, ONE_CHART, STEPS as COORDINATE_STEPS
uniform usampler2D page_coordinates;    // u and v, with a mark in the last bit of each, where the pages have the texel
uniform sampler2D base_texture;

// From the viewer to the point that is looked up, object frame, metres; how that changes by a pixel to the right, and upward.
vec3 sight, sight_right, sight_up;

// Cosine between a ray and the surface's normal, below which a pixel's step grows no more. Normals are smoother than facets:
// of 0.02, 0.08, 0.15 and 0.25, this one gives pictures most like those of the mesh.
const float FLATTEST = 0.08;
// Texels of an image that a pixel covers, from which on the finest mip tier is not looked up; stored colours serve instead.
const float FINEST_END = float(2 << MIP_TIER_LEVELS);

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

// Returns the linear colour at a place of the pages, level 0. stored: the linear colour that they hold there; border: whether the
// four texels may show several surfaces; right, up: what a pixel's step is, texels; covered: texels that a pixel covers.
vec3 painted(vec2 place, Around around, vec3 stored, bool border, vec2 right, vec2 up, float covered) {
    vec2 low = floor(place - 0.5), f = place - 0.5 - low;
    uvec2 code[4];
    for (int k = 0; k < 4; ++k) code[k] = texelFetch(page_coordinates, around.at[k], 0).xy;
    vec2 at = coordinates_of(code[0]), along = shortest(coordinates_of(code[1]) - at);
    vec2 upward = shortest(coordinates_of(code[2]) - at);
    bool has = true;
    if (!border && (code[0].y & uint(ONE_CHART)) != 0u) {
        vec2 bend = shortest(coordinates_of(code[3]) - at) - along - upward;
        along += f.y * bend;
        at += f.x * along + f.y * upward;
        upward += f.x * bend;
    } else {
        // Beside a seam or an edge: from the texel that counts most, on by what its own surface does on the other side of it.
        int most = 0;
        float heaviest = -1.0;
        for (int k = 0; k < 4; ++k) {
            float weight = (code[k].x & uint(HAS_COORDINATES)) != 0u ? around.weight[k] : -1.0;
            if (weight > heaviest) { heaviest = weight; most = k; }
        }
        has = heaviest >= 0.0;
        ivec2 corner = ivec2(most & 1, most >> 1), outward = 2 * corner - 1, middle = around.at[most];
        at = coordinates_of(code[most]);
        bool goes_on = (texelFetch(page_coordinates, middle + corner - 1, 0).y & uint(ONE_CHART)) != 0u;
        vec2 beside = coordinates_of(texelFetch(page_coordinates, middle + ivec2(outward.x, 0), 0).xy);
        vec2 above = coordinates_of(texelFetch(page_coordinates, middle + ivec2(0, outward.y), 0).xy);
        along = goes_on ? shortest(beside - at) * float(outward.x) : vec2(0.0);
        upward = goes_on ? shortest(above - at) * float(outward.y) : vec2(0.0);
        at += (f.x - float(corner.x)) * along + (f.y - float(corner.y)) * upward;
    }
    mat2 slope = mat2(along, upward);
    vec3 found = textureGrad(base_texture, at, slope * right, slope * up).rgb;
    return has ? mix(stored, found, clamp(log2(FINEST_END / covered), 0.0, 1.0)) : stored;
}
