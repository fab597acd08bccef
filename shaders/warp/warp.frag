// Writes which image owns the tile's texel; 1 − nearest·λ/w goes to the depth buffer.
flat in uint image;
layout(location = 0) out uint owner;

void main() { owner = image; }
