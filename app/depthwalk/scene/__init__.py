"""Read scene and path files: YAML text, checked key by key, then flattened into arrays.

`loader.load_scene` is the way in. `schema`, `environment` and `render_settings` (objects, rivals, effects) declare what
a file may hold; `scene` and `arrays` are what comes out. Nothing here needs OpenGL, trimesh, Pillow or SciPy to be
imported.
"""
