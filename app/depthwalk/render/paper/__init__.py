"""Draw as the papers do where the renderer normally does something else, for comparison."""
