// Reads one texel of a texture, without filtering and mip-maps, by its integer coordinates. Software rasterisers evaluate the
// level of a `texelFetch` for each pixel, which costs more than the texel.
#define texel_at(picture, at) textureLod(picture, (vec2(at) + 0.5) / vec2(textureSize(picture, 0)), 0.0)
