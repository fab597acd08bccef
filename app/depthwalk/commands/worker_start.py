"""Do ahead what every task would begin with, in the process that the workers of a cluster are forked from.

Nobody else imports this module: `multiprocessing` takes names of modules for that process and calls nothing, so that
the import does the work. It imports what tasks need, and reads a scene and a path that ship with the program, by which
the models of files get their validators, and curves their library. No GL context is made: none survives a fork. What
else workers of one job have in common they tell it later, see `cluster.zygote`.

Python's collector of garbage is off meanwhile, and never searches what was made: else each worker would search all of
it during its first task, and copy the memory that it shares with the others, in which the collector marks what it saw.
"""

import contextlib
from importlib import import_module

from depthwalk.cluster import zygote
from depthwalk.cluster.nanny import PRELOADED, ask_versions
from depthwalk.commands.program import without_garbage


def _rehearse() -> None:
    from depthwalk.resources import scene_root
    from depthwalk.scene.loader import load_scene
    from depthwalk.scene.path import load_path

    load_scene(scene_root() / "room.yaml").render.model_dump(mode="json")
    load_path(scene_root() / "paths" / "room.yaml").sample(0.5)
    ask_versions()


with without_garbage():
    for _name in PRELOADED:
        with contextlib.suppress(ImportError):  # told of by the task that needs it
            import_module(_name)
    with contextlib.suppress(Exception):  # likewise
        _rehearse()
zygote.serve()
