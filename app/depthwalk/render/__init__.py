"""Render a scene: cull its objects, plan how they are drawn, and run the passes of a frame.

Start at `renderer`, the outline of a frame, and `frame`, the contract of a pass; docs/architecture.md lists the rest.
"""
