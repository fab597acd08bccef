"""Import what tasks need, in the process that workers are forked from; nobody else imports this module.

`multiprocessing` takes the names of modules for that process and calls nothing, so that the import itself does the work.
Python's collector stays off meanwhile, and what was imported is never searched for garbage: each worker would do so
during its first task, and copy the pages that it shares with the others, since it marks what it has seen.
"""

import contextlib
import gc
from importlib import import_module

from depthwalk.cluster.nanny import PRELOADED

gc.disable()
for _name in PRELOADED:
    with contextlib.suppress(ImportError):  # told of by the task that needs it
        import_module(_name)
gc.freeze()
gc.enable()
