"""Offer the library's public interface, in front of the packages that do the work; `depthwalk` exports its names."""
