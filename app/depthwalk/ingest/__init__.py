"""Read mesh, picture and depth files into plain, frozen arrays.

This is the only package that imports trimesh, Pillow and OpenEXR; later stages know nothing of file formats. Every file
is treated as hostile: sizes are checked before memory is allocated, names may not lead out of the file's folder, and
anything damaged raises an InputError that names the file and the defect.
"""
