// Writes that no image owns the texel.
layout(location = 0) out uint owner;
#ifdef LIT
layout(location = 1) out vec4 light;
#endif

void main() {
    owner = 0u;
#ifdef LIT
    light = vec4(0.0);
#endif
}
