"""Measure what a frame of one object or of many costs, against the plainest engine that could draw it."""
