// Declares inputs that make a shader run per sample.
// MULTISAMPLED: a shader with PER_SAMPLE inputs runs for each sample of a pixel, with their values at the sample.
#ifdef MULTISAMPLED
#define PER_SAMPLE sample
#else
#define PER_SAMPLE
#endif
