"""Read scene and path files: YAML text, checked key by key, then flattened into arrays.

The entry point is `loader.load_scene`. `schema`, `environment` and the settings modules (`render_settings`,
`object_settings`, `effect_settings`) declare what a file may hold; `scene` and `arrays` define the result. Importing
this package needs no OpenGL, trimesh or SciPy, and Pillow only for colours that are given by name.
"""
