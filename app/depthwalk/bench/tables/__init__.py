"""Reproduce the papers' tables on this machine, beside the published figures, for `depthwalk tables`."""
