"""Stop a viewer who walks at surfaces, let them slide along these, and step up and down.

The viewer's `Body` is an upright cylinder that begins a step above its feet, so that whatever is lower is stepped on.
What the cylinder may touch of a triangle, seen from above, is a convex polygon, and the body a circle: walking is a
problem of the plane.

1. `ColliderStore` makes a `Collider` of each asset near the viewer, in the background: the triangles of the mesh, or of
   a level of its cooked depth images, without thin leaves (`foliage`), reduced to a few centimetres.
2. `Surroundings` finds the objects around the viewer (`near_objects`) and gathers their triangles every third of a
   metre.
3. `outlines` cuts these to the body's height: segments in the plane.
4. `sliding` finds the motion nearest to the wanted one that brings the circle no closer to any segment than its radius.
5. `footing` finds the surface on which the viewer stands.
6. `Obstacles` holds this together, from frame to frame.

Nothing here needs a window or GL. A frame in which the viewer walks takes some 0.1 ms for it. About every
twentieth gathers triangles, and takes 1 ms, or 4 ms beside dense ones. Who stands or flies takes nothing.
"""
