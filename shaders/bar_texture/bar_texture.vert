// Draws the bars of a height field as strips on the screen, one to each texel: straight from its surface down to where no
// neighbour is deeper, and as wide as the texel (Li, Wang and Wu 2004). Four vertices each. Twin: reference/bar_texture.py.
#from depthwalk.bake.images import Face
#from depthwalk.cook.lod_geometry import FACE_SHIFT
#include "common/per_sample.glsl"
#include "common/field_frame.glsl"
#include "common/rotation.glsl"
#include "common/view.glsl"

in vec3 in_origin;      // of the object, world, relative to the viewer
in vec4 in_rotation;
in float in_scale;

uniform sampler2D bars;     // depth of both ends, 0 to 1
uniform vec2 field_margin;  // half a texel
uniform uint first;         // number of the first object

const float END_ON = 0.01;  // pixels between the ends of a bar below which it has no direction on the screen

flat out uint object;
flat out uint image;
flat out vec2 inverses;                 // 1 / distance along the view axis, of the near and of the far end
flat out vec2 slope;                    // of that, per pixel along and across the bar, on the texel's rectangle
flat out float extent;                  // from end to end, pixels
noperspective PER_SAMPLE out vec2 place;    // from the near end along and across the bar, pixels

vec4 clip_from_field(vec3 at) {
    return clip_from_eye * vec4(in_origin + in_scale * rotate(in_rotation, object_from_field(at)), 1.0);
}

vec2 pixels(vec4 clip) { return clip.xy / clip.w * view_size / 2.0; }

void main() {
    ivec2 size = textureSize(bars, 0);
    int bar = gl_VertexID / 4, corner = gl_VertexID % 4;
    ivec2 texel = ivec2(bar % size.x, bar / size.x);
    vec2 at = (vec2(texel) + 0.5) / vec2(size);
    vec2 depth = texelFetch(bars, texel, 0).rg;
    vec4 near = clip_from_field(vec3(at, depth.x)), far = clip_from_field(vec3(at, depth.y));
    vec4 right = clip_from_field(vec3(at.x + field_margin.x, at.y, depth.x));
    vec4 up = clip_from_field(vec3(at.x, at.y + field_margin.y, depth.x));
    object = first + uint(gl_InstanceID);
    image = uint(FACE_TOP << FACE_SHIFT);
    if (min(min(near.w, far.w), min(right.w, up.w)) < depth_range.x) {  // beside or behind the viewer
        inverses = slope = place = vec2(0.0);
        extent = 0.0;
        gl_Position = vec4(2.0, 2.0, 2.0, 1.0);
        return;
    }
    inverses = 1.0 / vec2(near.w, far.w);
    vec2 begin = pixels(near), way = pixels(far) - begin;
    extent = length(way);
    vec2 along = extent < END_ON ? vec2(1.0, 0.0) : way / extent;
    // The texel's rectangle, turned to the bar's direction: how far it reaches along and across, and how its distance changes.
    mat2 axes = mat2(along, vec2(-along.y, along.x));
    vec2 u = (pixels(right) - begin) * axes, v = (pixels(up) - begin) * axes;
    vec2 reach = abs(u) + abs(v);
    float area = u.x * v.y - u.y * v.x;
    vec2 rise = vec2(1.0 / right.w, 1.0 / up.w) - inverses.x;
    slope = abs(area) < 1e-6 ? vec2(0.0) : vec2(rise.x * v.y - rise.y * u.y, rise.y * u.x - rise.x * v.x) / area;
    place = vec2(corner < 2 ? -reach.x : extent + reach.x, corner % 2 == 0 ? -reach.y : reach.y);
    vec2 point = (begin + axes * place) * 2.0 / view_size;
    gl_Position = vec4(point, clamp(near.z / near.w, -1.0, 1.0), 1.0);     // the fragment shader writes the depth
}
