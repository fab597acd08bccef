"""What a picture is seen through: camera, lens and uniform block; and where objects are in it."""
