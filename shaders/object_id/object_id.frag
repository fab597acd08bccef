// Writes which instance of the frame's polygons is in front.
flat in uint number;
layout(location = 0) out uint instance;
void main() { instance = number; }
