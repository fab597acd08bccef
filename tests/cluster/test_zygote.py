"""What workers find made by the process that they were forked from."""

import os
import subprocess
import sys

import pytest

from depthwalk.cluster import zygote

# A program, since a test has threads and may not fork. Each case is tried in a zygote of its own.
FORKS = """
import os, sys
from depthwalk.cluster import zygote

def fork(work):
    if (pid := os.fork()) == 0:
        try:
            work()
        finally:
            os._exit(0)
    os.waitpid(pid, 0)

def double(text):
    print("doubles", text[:9], end="; ", flush=True)
    return 2 * text if text != "bad" else int(text)

def ask(*keys):
    fork(lambda: [zygote.ask(key, double) for key in keys])

def say(*keys):
    fork(lambda: print(*(zygote.inherited(key) for key in keys), end="; ", flush=True))

for case in sys.argv[1:]:
    fork(lambda: [zygote.serve(), eval(case), print(flush=True)])
"""
CASES = {
    "ask('a'), say('a', 'a', 'b')": "doubles a; aa None None; ",  # handed over once
    "ask('a'), say('a'), say('a')": "doubles a; aa; aa; ",
    "ask('a'), ask('a'), say('a')": "doubles a; aa; ",
    "ask(*'abcb'), say('b', 'c')": "doubles b; bb None; ",  # the latest
    "ask('a'), say('a'), ask('b'), say('b', 'a')": "doubles a; aa; doubles b; bb None; ",
    "ask('b' * 70000), say('b' * 70000)": "None; ",  # too long
    "ask('bad'), say('bad'), ask('bad'), say('bad')": "doubles bad; None; None; ",  # not tried again
    "fork(lambda: (zygote.ask('a', double), say('a')))": "None; ",  # a worker that forks is no zygote
    "ask(*'a' * 5000), say('a')": "doubles a; aa; ",  # more than a socket holds
}


@pytest.mark.skipif(not hasattr(os, "fork"), reason="processes are not forked here")
def test_a_worker_inherits_what_an_earlier_one_asked_for() -> None:
    done = subprocess.run([sys.executable, "-c", FORKS, *CASES], capture_output=True, text=True, timeout=60)
    assert not done.stderr
    assert dict(zip(CASES, done.stdout.splitlines(), strict=True)) == CASES


def test_without_a_zygote_nothing_is_asked_or_inherited() -> None:
    zygote.ask("a", str.upper)
    assert zygote.inherited("a") is None
