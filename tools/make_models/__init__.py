"""Generate the demo's own meshes and textures; `python -m tools.make_models OUTDIR` makes them all.

`sdf` and `surfaces` give form, `relief` roughens it, `paint` colours it. `catalogue` lists what is made of that, and
`ship` bakes what travels with the program.
"""
