"""Declare the program `depthwalk` with the list of its commands, each imported only when it is used.

So `depthwalk --help` waits for no numerical or graphics library, and `depthwalk check` imports nothing that only other
commands need. A command with many imports does them after its options have been parsed.
"""

import gc
import os
from collections.abc import Iterator, Mapping
from importlib import import_module
from pathlib import PurePath
from typing import Annotated, Any

import typer

from depthwalk.commands.program import as_program
from depthwalk.commands.usage import HELP_OPTIONS, OneLineGroup, UsageError
from depthwalk.errors import printable

# By the module whose `main` is the command; the text is the first line of its docstring.
SUMMARIES = {
    "demo": "Walk through the garden, or another scene that ships with the program.",
    "view": "Open a window to walk through a scene.",
    "render": "Render a scene, or the frames of a camera path, to picture files.",
    "bake": "Bake meshes to depth images, NAME.dpci.exr.",
    "compare": "Measure how closely baked depth images resemble their mesh.",
    "quality": "Measure anti-aliasing, depth of field and shadows against reference pictures.",
    "bench": "Measure how long the frames of scenes and their passes take.",
    "tables": "Reproduce the papers' tables on this machine, beside the published figures, with additional curves.",
    "advise": "Find the quickest way to draw each asset of a scene on this machine, within an error limit.",
    "convert": "Make a scene of a glTF or USD file, with a mesh file for each of its models.",
    "check": "Check scene files, path files and meshes without rendering anything.",
    "cache": "Show what the cache of depth images holds, or clear it.",
    "info": "Show versions, the OpenGL renderer and limits, or what files hold.",
}


# Environment variables that libraries read when they are imported, unless the user has set them.
_ENVIRONMENT = {
    "OPENBLAS_THREAD_TIMEOUT": "4",  # NumPy's threads wait 2^4 cycles for work, not 2^26 in which they occupy a core
    "PYDANTIC_DISABLE_PLUGINS": "__all__",  # do not search every installed package for plugins
}


class _LazyCommands(Mapping[str, Any]):
    """The commands by name, each imported when it is looked up."""

    def __getitem__(self, name: str) -> Any:
        if name not in SUMMARIES:
            raise KeyError(name)
        return typer.main.get_command(as_program(import_module(f"depthwalk.commands.{name}").main, name))

    def __iter__(self) -> Iterator[str]:
        return iter(SUMMARIES)

    def __len__(self) -> int:
        return len(SUMMARIES)


class _Commands(OneLineGroup):
    """The group of all commands, listed without importing them."""

    def __init__(self, **options: Any) -> None:
        super().__init__(**options | {"commands": {}})
        self.commands: Any = _LazyCommands()

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        """Find the command that `args` begins with; if that is a file, explain how to open it."""
        try:
            return super().resolve_command(ctx, args)
        except UsageError:
            if PurePath(args[0]).suffix:
                raise UsageError(
                    f"no command is given; to open a file: depthwalk view {printable(args[0])}", ctx
                ) from None
            raise

    def format_commands(self, ctx: Any, formatter: Any) -> None:
        """Write the section of `--help` that lists the commands."""
        with formatter.section("Commands"):
            formatter.write_dl(list(SUMMARIES.items()))


app = typer.Typer(
    name="depthwalk",
    cls=_Commands,
    help="Walk through scenes too heavy to draw as meshes: depth images replace these, and are warped on the GPU.\n\n"
    "Begin with `depthwalk demo`, or open a model of yours: `depthwalk view model.glb`.",
    context_settings=HELP_OPTIONS,
    no_args_is_help=True,
    add_completion=False,
    rich_markup_mode=None,  # errors are one plain line, not a box that breaks paths
    pretty_exceptions_enable=False,
)


def main() -> None:
    """Run the program `depthwalk` with the arguments of the process."""
    for name, value in _ENVIRONMENT.items():
        os.environ.setdefault(name, value)
    gc.disable()  # until a command has been imported, see `without_garbage_collection`
    app()


@app.callback(invoke_without_command=True)
def _common(version: Annotated[bool, typer.Option("--version", help="Print the version and exit.")] = False) -> None:
    if version:
        import depthwalk

        print(depthwalk.__version__)
        raise typer.Exit
