"""Level of detail: rules that choose levels, and meshes in place of depth images near by."""
