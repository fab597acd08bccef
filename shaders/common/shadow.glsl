// Looks up what part of the sun's light reaches a pixel's surface, as the pass `sun` found.
#ifdef SHADOWS
uniform sampler2D shadow_texture;
float sun_share(vec2 uv) { return texture(shadow_texture, uv).r; }
#else
float sun_share(vec2 uv) { return 1.0; }
#endif
