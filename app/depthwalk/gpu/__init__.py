"""Create GL objects: the one package that does.

`device` has the context and the scopes that own objects, `program` makes programs of shader files, `state` sets GL
state for a block, `instances` uploads records per object, `timers` measures passes.
"""
