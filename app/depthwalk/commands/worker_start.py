"""Do in advance what every task would begin with, in the process from which the workers of a cluster are forked.

No code imports this module: `multiprocessing` is given module names to preload in that process and calls nothing, so
the import does the work. It imports what tasks need, and reads a shipped scene and path, which builds the validators of
the file models and loads the library for curves. No GL context is created, since none survives a fork. Further data
that workers of one job share is provided later, see `cluster.zygote`.

Python's garbage collector is off meanwhile, and never searches these objects. Otherwise each worker would search all of
them during its first task, and copy the memory that it shares with the others, in which the collector marks objects.
"""

import contextlib
from importlib import import_module

from depthwalk.cluster import zygote
from depthwalk.cluster.nanny import PRELOADED, ask_versions
from depthwalk.commands.program import without_garbage_collection


def _rehearse() -> None:
    from depthwalk.resources import scene_root
    from depthwalk.scene.loader import load_scene
    from depthwalk.scene.path import load_path

    load_scene(scene_root() / "room.yaml").render.model_dump(mode="json")
    load_path(scene_root() / "paths" / "room.yaml").sample(0.5)
    ask_versions()


with without_garbage_collection():
    for _name in PRELOADED:
        with contextlib.suppress(ImportError):  # reported by the task that needs it
            import_module(_name)
    with contextlib.suppress(Exception):  # likewise
        _rehearse()
zygote.serve()
