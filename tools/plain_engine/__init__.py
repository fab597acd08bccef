"""Measure what a frame of one object costs, against the plainest engine that could draw it."""
