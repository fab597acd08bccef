"""Image quality of depth images against the mesh that they were made from. The method: docs/quality-method.md."""
