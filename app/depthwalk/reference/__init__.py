"""Contain NumPy twins of the shaders' mathematics: plain, slow, and compared with the GPU by the tests.

A twin states in array notation what a shader computes per vertex or per pixel. It is written from the paper's equation,
not from the shader, so that comparing the two finds a mistake in either. Twins are not used to make any picture that
users see. Each module's docstring names the shaders it mirrors and the source of the mathematics.
"""
