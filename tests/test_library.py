"""Assets of a scene: what is read, and what is kept."""

import gc
import weakref

import depthwalk.bakery
from depthwalk.library import SceneLibrary
from depthwalk.scene.loader import load_scene


def test_a_mesh_read_to_be_baked_is_not_kept(tiny_scene, tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "empty"))
    read = []

    def watched(*arguments, **options):
        mesh = load_mesh(*arguments, **options)
        read.append(weakref.ref(mesh))
        return mesh

    load_mesh = depthwalk.bakery.load_mesh
    monkeypatch.setattr(depthwalk.bakery, "load_mesh", watched)
    library = SceneLibrary(load_scene(tiny_scene).assets)
    assert library.baked(0) is not None
    gc.collect()
    assert [mesh() for mesh in read] == [None]
    drawn = library.mesh(0)
    assert library.mesh(0) is drawn and len(read) == 2


def test_a_mesh_that_is_there_already_is_baked(tiny_scene, tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "empty"))
    library = SceneLibrary(load_scene(tiny_scene).assets)
    assert library.mesh(0) is not None
    monkeypatch.setattr(depthwalk.bakery, "load_mesh", None)  # reading once more would fail
    assert library.baked(0) is not None


def test_depth_images_that_are_there_are_told_of_too(tiny_scene, tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    for kept in (False, True):
        told = []
        SceneLibrary(load_scene(tiny_scene).assets, lambda *what, told=told: told.append(what)).baked(0)
        assert told[0] == ("ball", "depth images") and (len(told) == 1) == kept
