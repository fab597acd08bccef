"""Compile loops with numba, and keep the code, for the folders `kernels` of other packages.

numba is an extra of this package, `depthwalk[fast]`. Nothing here imports it before loops are loaded.
"""
