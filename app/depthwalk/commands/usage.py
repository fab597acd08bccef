"""Make commands whose mistakes in the options are reported in one line, and whose help names arguments plainly."""

import sys
from typing import Any

import typer
import typer.core

from depthwalk.commands.exit_codes import BAD_INPUT
from depthwalk.commands.failures import tell, tell_failure, tell_mistakes
from depthwalk.errors import InputError, printable

HELP_OPTIONS = {"help_option_names": ["-h", "--help"]}

# Names of options in other programs, and their names here; suggested if the command has the latter.
_SIZE = "--resolution", "--dpci-resolution"
_ELSEWHERE = {
    "--size": _SIZE, "--width": _SIZE, "--height": _SIZE, "--fov": ("--camera-view-angle",),
    "--position": ("--camera-position",), "--target": ("--camera-target",), "--silent": ("--quiet",),
    "--transparent": ("--no-background",), "--hdri": ("--sky",), "--hdri-file": ("--sky",),
}  # fmt: skip

UsageError: Any = typer.BadParameter.__base__  # of the click that this typer brings along


class _OneLineErrors:
    """Mix-in: report a mistake in the options in one line, with exit code 2, as `guarded` reports wrong input."""

    def main(self, *args: Any, standalone_mode: bool = True, **extra: Any) -> Any:
        """Run the command line; see `click.Command.main`."""
        try:
            code = super().main(*args, standalone_mode=False, **extra)  # type: ignore[misc]  # of the class it is mixed into
            if standalone_mode:
                sys.stdout.flush()  # --help and --version do not pass through `guarded`
        except InputError as error:  # about a file that the arguments name
            if not standalone_mode:
                raise
            tell_mistakes(error)
            code = BAD_INPUT
        except UsageError as error:
            if not standalone_mode:
                raise
            if type(error).__name__ == "NoArgsIsHelpError":  # called without any argument
                tell(error.format_message())
            else:
                tell(_refused_value(error) or _misuse(error))
            code = BAD_INPUT
        except OSError as error:  # stdout cannot be written
            if not standalone_mode:
                raise
            code = tell_failure(error)
        if standalone_mode:
            sys.exit(code)
        return code


def _refused_value(error: Any) -> str | None:
    """Return the line about a number that is none or out of range, worded as the program's own; None for other errors.

    typer has numbers checked by pydantic, since version 0.29, and quotes its message without the value.
    """
    mistake = error.__cause__
    if getattr(error, "param", None) is None or type(mistake).__name__ != "ValidationError":
        return None
    from depthwalk.params import plain_message  # here, since few runs need pydantic this early

    detail = mistake.errors(include_url=False)[0]
    wrong = plain_message(detail).rpartition(", not ")[0]
    return f"{error.param.opts[0]} {printable(detail['input'])}: {wrong}" if wrong else None


def _misuse(error: Any) -> str:
    """Return the line about a command, option or argument that is unknown, missing or wrong."""
    command = error.ctx.command_path if error.ctx else "depthwalk"
    _suggest_own_option(error)
    if type(error).__name__ == "MissingParameter" and "-o" in getattr(error.param, "opts", ()):
        return f"{command}: name the file to write by -o FILE ({command} --help tells more)"
    message = " ".join(error.format_message().split()).removesuffix(".").replace("Value error, ", "")
    return f"{command}: {message} ({command} --help tells more)"


def _suggest_own_option(error: Any) -> None:
    """Complete the error about an unknown option by its name here, if it is known from other programs."""
    if error.ctx and (meant := _ELSEWHERE.get(getattr(error, "option_name", ""))):
        own = [name for param in error.ctx.command.params for name in param.opts]
        error.possibilities = [name for name in meant if name in own] or error.possibilities


class OneLineGroup(_OneLineErrors, typer.core.TyperGroup):
    """Group commands, and report a mistake in their options in one line."""


class OneLineCommand(_OneLineErrors, typer.core.TyperCommand):
    """Run a command, and report a mistake in its options in one line.

    Its help calls arguments by their names: `SCENE`, where typer would write `{SCENE}` and `SCENE <path>`.
    """

    def parse_args(self, ctx: Any, args: list[str]) -> Any:
        """Parse the arguments; report mistakes under the name of this command instead of the whole program's."""
        try:
            return super().parse_args(ctx, args)
        except UsageError as error:
            error.ctx = error.ctx or ctx
            raise

    def collect_usage_pieces(self, ctx: Any) -> list[str]:
        """Return the parts of the line "Usage:" after the command's name."""
        return [piece.replace("{", "").replace("}", "") for piece in super().collect_usage_pieces(ctx)]

    def format_options(self, ctx: Any, formatter: Any) -> None:
        """Write the sections of `--help` that list arguments and options."""
        records: dict[str, list[tuple[str, str]]] = {"Arguments": [], "Options": []}
        for param in self.get_params(ctx):
            if record := param.get_help_record(ctx):
                is_argument = param.param_type_name == "argument"
                name = record[0].partition(" <")[0] if is_argument else record[0]
                records["Arguments" if is_argument else "Options"].append((name, record[1]))
        for title, rows in records.items():
            if rows:
                with formatter.section(title):
                    formatter.write_dl(rows)
