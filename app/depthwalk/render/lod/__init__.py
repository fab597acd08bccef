"""Choose levels of detail, and meshes in place of depth images: near by, and where they are quicker."""
