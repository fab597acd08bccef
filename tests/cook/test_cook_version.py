"""COOK_VERSION goes with the code that cooks: cached files made by other code must not be taken."""

from pathlib import Path

from cook_digest import RECORD, cook_digest, digest, record_line

HELPER = '''"""Text."""
from math import floor
import numpy as np

STEP = 4

class Kept:
    """Text."""
    side = STEP

def helped(x):
    """Text."""
    return np.sqrt(x) * floor(x)  # why

def unused(x):
    return x
'''
MAIN = """from pack.helper import Kept, helped
from pack import sizes

def cook(x):
    return helped(x) + Kept.side + sizes.MOST
"""


def test_the_version_was_raised_when_the_code_that_cooks_changed() -> None:
    version, recorded = RECORD.read_text(encoding="utf-8").split()
    command = "python tests/cook_digest.py"
    assert recorded == cook_digest(), (
        f"the code that cooks differs from that of COOK_VERSION {version}: raise COOK_VERSION, unless what "
        f"`cook_object` yields is the same bytes as before; then run `{command}`, which records the new digest"
    )
    assert RECORD.read_text(encoding="utf-8") == record_line(), f"COOK_VERSION was changed: run `{command}`"


def package(folder: Path, **files: str) -> str:
    """A package of these modules, in a folder of its own."""
    root = folder / str(len(list(folder.iterdir())))
    (root / "pack").mkdir(parents=True)
    texts = {"helper": HELPER, "main": MAIN, "sizes": "MOST = 3\nLEAST = 1\n"} | files
    for name, text in texts.items():
        (root / "pack" / f"{name}.py").write_text(text)
    return digest(root, "pack.main", "cook")


def test_the_digest_follows_imports_and_ignores_what_does_not_matter(tmp_path: Path) -> None:
    before = package(tmp_path)
    for old, new in (
        ("# why", "# because"),
        ('"""Text."""', '"""Other text."""'),
        ("STEP = 4", "STEP = (4)"),
        ("return x\n", "return -x\n"),
    ):
        assert old in HELPER and package(tmp_path, helper=HELPER.replace(old, new)) == before, new
    for old, new in (("STEP = 4", "STEP = 5"), ("np.sqrt", "np.cbrt"), ("import floor", "import ceil as floor")):
        assert old in HELPER and package(tmp_path, helper=HELPER.replace(old, new)) != before, new
    assert package(tmp_path, sizes="MOST = 4\nLEAST = 1\n") != before
    assert package(tmp_path, sizes="MOST = 3\nLEAST = 2\n") == before


def test_the_digest_does_not_see_where_modules_are(tmp_path: Path) -> None:
    moved = MAIN.replace("pack.helper", "pack.elsewhere")
    assert package(tmp_path, elsewhere=HELPER, main=moved) == package(tmp_path)
