"""Measure what frames cost, and show it as text, JSON and HTML."""
