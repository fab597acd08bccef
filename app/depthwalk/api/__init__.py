"""The library's public interface, in front of the packages that do the work: import its names from `depthwalk`."""
