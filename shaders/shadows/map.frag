// Writes nothing: depth is all that a shadow map holds.
void main() {}
