"""Describe what a picture is seen through (camera, lens, uniform block), and where objects are in it."""
