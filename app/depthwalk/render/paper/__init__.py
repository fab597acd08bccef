"""Baselines of the papers that the renderer itself does not need."""
