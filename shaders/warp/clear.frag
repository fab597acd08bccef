// Writes that no image owns the texel.
layout(location = 0) out uint owner;

void main() { owner = 0u; }
