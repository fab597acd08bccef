"""NumPy twins of the shaders' mathematics: plain, slow, and what the tests compare the GPU with."""
