"""Run the program as `python -m depthwalk`, for installations whose scripts are not on the path."""

from depthwalk.commands.cli import main

main()
