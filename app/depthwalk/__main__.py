"""Run the program, as `depthwalk` or, where installed scripts are not on the path, as `python -m depthwalk`."""

from depthwalk.commands.interruption import ended_by_its_signal, leave_when_interrupted


def main() -> None:
    """Run the program `depthwalk` with the arguments of the process."""
    leave_when_interrupted()  # before the imports, which take a quarter of a second
    with ended_by_its_signal():
        from depthwalk.commands import cli

        cli.main()


if __name__ == "__main__":
    main()
