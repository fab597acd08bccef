"""Measure frame times, and show them as text, JSON and HTML, for `depthwalk bench` and `bench_table`."""
