"""The renderer: what is seen of a scene, drawn pass by pass."""
