"""Describe what a picture is seen through (camera, lens, uniform block), and where objects are in it.

`view` holds camera and matrices, `view_block` their uniforms, `bounds` the bounding volumes of objects, `lens` the
depth of field; `field_of_view` widens or reduces a view, `framing` points a camera at objects.
"""
