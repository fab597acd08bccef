"""Measure again what the tables of the papers say, and set their figures beside ours; for `depthwalk tables`."""
