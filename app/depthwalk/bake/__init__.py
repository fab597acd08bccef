"""From a mesh to depth images: sampling, connecting, choosing owners, and the file that keeps the result."""
