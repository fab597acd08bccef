"""`python -m depthwalk`: the program, where its script is not on the path."""

from depthwalk.commands.cli import main

main()
