"""Plan a frame: which objects are drawn, at which detail, and in which draw calls.

`planner` plans an occlusion phase from the choices of `object_detail`, `far_cluster_planner` the far clusters,
`translucency_planner` translucent surfaces; the result are the `draw_lists`, and `material_depth` for shading.
"""
