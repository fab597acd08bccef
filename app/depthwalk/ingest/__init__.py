"""Read mesh, picture and depth files into plain, frozen arrays.

It is the only package that imports trimesh, Pillow and OpenEXR: what comes later knows nothing of file formats. Every
file is taken for hostile: sizes are checked before memory is allocated, names may not lead out of the file's folder,
and whatever is damaged raises an InputError that names the file and the defect.
"""
