// Unpacks depth samples from vertices, to the object frame: 16-bit positions within a box.
#from depthwalk.cook.lod_geometry import POSITION_STEPS, IMAGE_BITS, EASE_SHIFT, EASE, BORDER
#include "common/depth_object.glsl"

// The last component: number of the image with its flags, and the part of the meso-structure's depth that applies.
uint sample_image(uvec4 texel) { return texel.w & (1u << IMAGE_BITS) - 1u; }
float sample_ease(uvec4 texel) { return float(texel.w >> EASE_SHIFT) / float(EASE); }
float sample_setback(uvec4 texel) { return (texel.w & uint(BORDER)) != 0u ? setback : 0.0; }
vec3 sample_position(uvec4 texel) { return box_low + vec3(texel.xyz) * (box_size / float(POSITION_STEPS)); }
