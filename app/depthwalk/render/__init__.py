"""Draw what is seen of a scene, pass by pass."""
