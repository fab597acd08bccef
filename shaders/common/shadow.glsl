// What part of the sun's light reaches a pixel's surface, as the pass `sun` found.
#ifdef SHADOWS
uniform sampler2D shadow_texture;
float sun_share(ivec2 pixel) { return texelFetch(shadow_texture, pixel, 0).r; }
#else
float sun_share(ivec2 pixel) { return 1.0; }
#endif
