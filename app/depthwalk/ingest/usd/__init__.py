"""Read USD scenes (.usd, .usda, .usdc, .usdz) by usd-core, the extra `depthwalk[usd]`, as glTF.

`translation` is what the rest of the program sees: it returns a GLB file that shows what a USD file shows, so that all
that reads, converts and describes glTF does the same for USD. It runs `worker` in a process of its own, the only one
that imports `pxr`; the other modules are parts of the worker.

    layers → scene (prims, instances) → meshes, materials with pictures, cameras and lights, movements → glb
"""
