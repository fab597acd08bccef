"""Cull objects that are hidden behind what is drawn already.

`depth_readback` reads the depth buffer, `occlusion_test` tests cylinders against it, `object_occlusion` tests objects.
"""
