"""Create and own GL objects; no other package creates any.

`device` holds the context and the scopes that own objects, `program` compiles programs from shader files, `state` sets
GL state for a block, `instances` uploads records per object, `timers` measures passes.
"""
