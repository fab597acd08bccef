"""Measure how long frames take, and show the times as text, JSON and HTML, for `depthwalk bench` and `bench_table`."""
