"""The only place that imports trimesh and Pillow: files in, plain frozen arrays out."""
