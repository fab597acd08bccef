"""Make the FBX, COLLADA, 3D Studio and 3MF files that fuzzing begins with."""

from dataclasses import replace
from functools import cache

from fuzz.case import Files
from fuzz.dae_files import dae, skinned_dae
from fuzz.fbx_files import fbx, skinned_fbx
from fuzz.seeds import HOSTILE, picture
from fuzz.small_scenes import Paint, Use, cube
from fuzz.three_ds_files import three_ds
from fuzz.three_mf_files import three_mf


@cache
def _uses() -> list[Use]:
    """Return three nodes: one of colours, one of a picture and mirrored, one translucent."""
    coloured = cube()
    plain = replace(coloured, colours=None)
    skin, glass = Paint(name="skin", picture="skin.png"), Paint(name="glass", colour=(0.1, 0.5, 0.2), opacity=0.5)
    return [
        Use(name="one", shape=coloured, paint=Paint(name="white", colour=(1, 1, 1), emission=(0, 0.5, 0))),
        Use(name="two", shape=plain, paint=skin, moved=(3, 0, 0), turned=(10, 20, 30), scaled=(-1, 1, 0.5)),
        Use(name="three", shape=plain, paint=glass, moved=(0, 3, 0)),
    ]


def _pictures() -> Files:
    return {"skin.png": picture("PNG")}


def _hostile(suffix: str) -> list[Files]:
    return [{path.name: path.read_bytes()} for path in sorted((HOSTILE / "meshes").glob(f"*{suffix}"))]


def fbxs() -> list[Files]:
    """Return binary files and files of text, one with an embedded picture, one with joints."""
    return [
        fbx(_uses(), _pictures()),
        fbx(_uses()[1:2], _pictures(), embedded=True, version=7700, z_up=True),
        fbx(_uses()[1:2], _pictures(), text=True),
        fbx(_uses()[:1], {}, text=True, centimetres=1.0),
        {"joints.fbx": skinned_fbx()},
        *_hostile(".fbx"),
    ]


def daes() -> list[Files]:
    """Return files with pictures, colours and joints."""
    return [
        dae(_uses(), _pictures()),
        dae(_uses()[:1], {}, up="Z_UP", metre=0.01),
        {"joints.dae": skinned_dae()},
        *_hostile(".dae"),
    ]


def three_dss() -> list[Files]:
    """Return a file of several nodes and one of a single one."""
    return [three_ds(_uses(), _pictures()), three_ds(_uses()[1:2], _pictures()), *_hostile(".3ds")]


def three_mfs() -> list[Files]:
    """Return a file of one model, and one of several, which has no picture."""
    return [
        three_mf(_uses(), _pictures()),
        three_mf([_uses()[0], _uses()[2]], {}, parts=True, unit="inch"),
        *_hostile(".3mf"),
    ]
