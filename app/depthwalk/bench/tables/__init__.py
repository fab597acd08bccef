"""Reproduce the papers' tables, and set the papers' figures beside ours; for `depthwalk tables`."""
