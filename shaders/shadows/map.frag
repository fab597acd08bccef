// Depth is all that a shadow map holds.
void main() {}
