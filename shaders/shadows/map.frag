// Writes nothing, as a shadow map holds only depth. CUT_OUT: light passes where the alpha of a texture is low.
#ifdef CUT_OUT
uniform sampler2D base_texture;
uniform float cutoff;       // alpha
in vec2 uv;

void main() { if (texture(base_texture, uv).a < cutoff) discard; }
#else
void main() {}
#endif
