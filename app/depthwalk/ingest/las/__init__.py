"""Read laser scans in LAS and LAZ files (ASPRS LAS 1.0 to 1.4) by laspy, the extra `depthwalk[las]`.

`decoder` is what the rest of the program sees; it runs `worker` in a process of its own.
"""
