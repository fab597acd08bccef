// Keeps how far ahead of a camera that has moved the nearest surface of a finished picture is, by cells of the screen, metres.
flat in float ahead;
layout(location = 0) out float nearest;

void main() { nearest = ahead; }
