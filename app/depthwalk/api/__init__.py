"""Provide the library's public interface on top of the packages that do the work; `depthwalk` exports its names."""
