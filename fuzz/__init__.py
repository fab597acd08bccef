"""Try the readers of files with input that is broken on purpose: `python -m fuzz`, docs/fuzzing.md."""
