// Writes how far ahead of a camera that has moved the picture's nearest surface is in each cell of the screen, metres.
flat in float ahead;
layout(location = 0) out float nearest;

void main() { nearest = ahead; }
