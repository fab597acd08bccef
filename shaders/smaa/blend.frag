// Blends each pixel with its neighbours, in linear light, by the areas that lines cut off it (SMAA, §4.4).
uniform sampler2D lit_texture;      // as it was
uniform sampler2D weight_texture;

layout(location = 0) out vec4 lit;

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy), last = textureSize(lit_texture, 0) - 1;
    ivec2 up = min(pixel + ivec2(0, 1), last), right = min(pixel + ivec2(1, 0), last);
    vec4 own = texelFetch(weight_texture, pixel, 0);
    vec2 vertical = vec2(own.r, texelFetch(weight_texture, up, 0).g);
    vec2 horizontal = vec2(own.b, texelFetch(weight_texture, right, 0).a);
    if (vertical + horizontal == vec2(0.0)) discard;
    bool across = max(vertical.x, vertical.y) > max(horizontal.x, horizontal.y);
    vec2 weight = across ? vertical : horizontal;
    weight /= max(1.0, weight.x + weight.y);
    ivec2 low = max(pixel - (across ? ivec2(0, 1) : ivec2(1, 0)), ivec2(0)), high = across ? up : right;
    lit = texelFetch(lit_texture, pixel, 0) * (1.0 - weight.x - weight.y);
    lit += texelFetch(lit_texture, low, 0) * weight.x + texelFetch(lit_texture, high, 0) * weight.y;
}
