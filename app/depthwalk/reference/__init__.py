"""Hold NumPy twins of the shaders' mathematics: plain, slow, and what the tests compare the GPU with.

A twin states in array notation what a shader computes per vertex or per pixel. It is written from the paper's equation,
not from the shader, so that a test which compares the two finds a mistake in either. No picture that users see is made
by a twin. Each module's docstring names the shaders it mirrors and the source of the mathematics.
"""
