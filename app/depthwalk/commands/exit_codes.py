"""Define the exit codes of all commands. Besides these, 0 means done, and 143 ended by SIGTERM.

This module imports nothing, since `interruption` needs it before anything else.
"""

FAILURE = 1  # a failure of the machine, or a bug
BAD_INPUT = 2  # a mistake in the files or options that the user gave
INTERRUPTED = 130  # ended by Ctrl-C: 128 + SIGINT, as in shells
