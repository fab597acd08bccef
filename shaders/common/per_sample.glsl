// Declares inputs that make a shader run per sample.
// MULTISAMPLED: a shader that has inputs PER_SAMPLE runs for each sample of a pixel, with their values at the sample.
#ifdef MULTISAMPLED
#extension GL_ARB_gpu_shader5 : require
#define PER_SAMPLE sample
#else
#define PER_SAMPLE
#endif
