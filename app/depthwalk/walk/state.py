"""Hold what the window shows and what keys and panel change: viewer, recording, lens, visible parts."""

from dataclasses import dataclass, field, replace
from enum import Enum
from typing import Any

from pyglm import glm

from depthwalk.errors import InputError
from depthwalk.render.renderer import Renderer
from depthwalk.scene.arrays import Representation
from depthwalk.scene.scene import Scene
from depthwalk.walk.changes import FileValues
from depthwalk.walk.files import SavedTo, saved_to
from depthwalk.walk.focus import FocusPull
from depthwalk.walk.framing import home_in
from depthwalk.walk.inspected import Inspected
from depthwalk.walk.playback import Playback
from depthwalk.walk.recorder import Recorder, save_path, tolerance_in
from depthwalk.walk.shares import LateShares
from depthwalk.walk.times import FrameTimes, PictureTimes
from depthwalk.walk.viewer import Viewer

_ROUNDING = 1e-6  # by which a camera that nobody has moved may differ from another, of its distance to the target


class Keeping(Enum):
    """Name what can be done with values that differ from the file's."""

    COPY = "copy"
    SAVE = "save"
    UNDO = "undo"


@dataclass
class State(Viewer):
    """Hold one walk: its viewer and everything else that persists from frame to frame.

    Attributes
    ----------
    home_is_framed
        Whether `home` was chosen to show all objects, rather than given by a file or the user.
    window_aspect
        Width / height that the window had last; 0 before it is known.
    recorder
        The recording, or None while nothing is recorded.
    times
        Durations from each picture shown by the window to the next.
    scene_times
        Time spent on each of the last frames of the scene.
    scene_scale
        Pixels of the last of them per pixel of the window, along either axis.
    shares
        The part of the objects' pixels that each representation drew in a recent frame.
    pull
        The change of the lens to another focus distance.
    inspected
        The object that the user inspects.
    hud
        Whether the window shows the HUD.
    panel
        Whether the window shows the panel.
    help
        Whether the window shows the list of keys.
    atlas
        Whether the window shows the atlas of impostors.
    asked
        What the user has asked, in the panel, to do with changed values; None once it is done.
    file_values
        What the scene's file says of what the panel changes.
    saved_to
        Where values that differ from those can be saved.
    """

    home_is_framed: bool = False
    window_aspect: float = 0.0
    recorder: Recorder | None = None
    times: PictureTimes = field(default_factory=PictureTimes)
    scene_times: FrameTimes = field(default_factory=FrameTimes)
    scene_scale: float = 1.0
    shares: LateShares = field(default_factory=LateShares)
    pull: FocusPull = field(default_factory=FocusPull)
    inspected: Inspected = field(default_factory=Inspected)
    hud: bool = True
    panel: bool = False
    help: bool = False
    atlas: bool = False
    asked: Keeping | None = None
    file_values: FileValues = field(init=False)
    saved_to: SavedTo = field(init=False)

    def __post_init__(self) -> None:
        """Remember what the scene's file says, before anything is changed."""
        self._remember_file()

    def _remember_file(self) -> None:
        self.file_values, self.saved_to = FileValues(self.scene), saved_to(self.scene.path)

    def show(self, scene: Scene, renderer: Renderer, aspect: float) -> None:
        """Show another scene, or reload the present one, which keeps how the user looks at it.

        That is the camera and its path, the representation (which `renderer` has already) and, where it differs from
        the file, what is inspected instead of the lit picture: none of them is the scene's own. All other settings
        become those of the file.

        Parameters
        ----------
        scene
            The scene to show.
        renderer
            The renderer that draws the scene.
        aspect
            Width / height of the window.
        """
        again, self.complaint = scene.files == self.scene.files, ""
        self.tell(f"Reloaded {scene.title}" if again else scene.title)
        self.end_recording()  # its message is more important
        inspection = self.changed.get("render", {}).get("inspection", {}) if again else {}
        self.scene, self.renderer, self.shares, self.inspected = scene, renderer, LateShares(), Inspected()
        self._remember_file()
        for name, value in inspection.items():
            setattr(scene.render.inspection, name, value)
        self.home, self.home_is_framed = home_in(scene, renderer, aspect), scene.camera is None
        if not again:
            self.moment, self.is_animated = 0.0, True
            self.playback = None
            self.arrive()

    @property
    def changed(self) -> dict[str, Any]:
        """Return the values that differ from those of the scene's file; see `FileValues.changed`."""
        chosen = self.chosen_fov if self.chosen_fov == self.camera.fov else None  # not while a path sets another
        return self.file_values.changed(chosen)

    @property
    def unsaved(self) -> dict[str, Any]:
        """Return those of `changed` that would be missed when the window closes.

        None of a model without a scene file is, nor what is inspected instead of the lit picture.
        """
        if self.saved_to == "nowhere":
            return {}
        changed = self.changed
        changed.get("render", {}).pop("inspection", None)
        return {group: values for group, values in changed.items() if values}

    def do_without_samples(self) -> None:
        """Draw without anti-aliasing, since the machine lacks that of the settings.

        It counts as a change only if the user has chosen what the machine lacks.
        """
        is_chosen = "aa" in self.changed.get("render", {})
        self.renderer.settings.aa = "none"
        if not is_chosen:
            self.file_values.accept({"render": {"aa": "none"}})

    def undo_changes(self) -> None:
        """Give the scene the values of its file again."""
        speed, changed = self.scene.walk.speed, self.changed
        self.file_values.restore()
        if self.scene.walk.speed != speed:
            self.reset_speed()
        if "camera" in changed and self.file_values.fov is not None:
            self.set_fov(self.file_values.fov)

    def accept_changes(self) -> None:
        """Count changed values, which have been saved, as those of the scene's file; Home takes over the lens."""
        changed, fov = self.changed, self.chosen_fov
        if "camera" in changed and fov is not None and self.home.fov == self.file_values.fov:
            self.home = replace(self.home, fov=fov)
        self.file_values.accept(changed, fov)

    def fit_home(self, aspect: float) -> None:
        """Fit `home`, if it was chosen to show all objects, to a window of width / height `aspect`."""
        if self.home_is_framed:
            self.home = home_in(self.scene, self.renderer, aspect)

    def follow_window(self, aspect: float) -> None:
        """Note width / height of the window; if it changed, keep all objects in a view that was chosen to show them.

        Whoever has moved since stays where they are, and so do paths, recordings and turntables.
        """
        before, self.window_aspect = self.window_aspect, aspect
        if before in (0, aspect) or not (self.home_is_framed and self._is_at_home() and self.recorder is None):
            return
        self.fit_home(aspect)
        self.jumps += 1
        self._place(self.home)

    def _is_at_home(self) -> bool:
        """Return whether the camera is at `home`, but for what rounding moves it."""
        camera, home = self.camera, self.home
        moved = glm.distance(glm.dvec3(*camera.position), glm.dvec3(*home.position)) / glm.length(home.look)
        turned = glm.distance(glm.normalize(camera.look), glm.normalize(home.look))
        return camera.fov == home.fov and max(moved, turned) < _ROUNDING

    def toggle_recording(self) -> None:
        """Begin recording the camera, or end the recording and save it."""
        if self.recorder is None:
            self.recorder = Recorder()
            self.tell("Recording the camera; K saves it")
        else:
            self.end_recording()

    def record(self, dt: float) -> None:
        """Add the camera, `dt` seconds after the last frame, to a recording in progress; save it when it is full."""
        if self.recorder is not None:
            self.recorder.add(dt, self.camera)
            if self.recorder.full:
                self.end_recording()

    def end_recording(self) -> None:
        """Save the recording as a path file, which the key P plays from now on; do nothing without a recording."""
        recorder, self.recorder = self.recorder, None
        if recorder is None:
            return
        if not recorder.seconds:
            self.tell("Nothing was recorded")
            return
        path = recorder.path(tolerance_in(self.extent[1]))
        try:
            file = save_path(path)
        except (OSError, InputError) as error:
            self.tell(f"The recording could not be saved: {error}")
            return
        self.playback = Playback(path)
        self.tell(f"Saved {file}: {recorder.seconds:.1f} s in {len(path.times)} keyframes")

    def focus(self) -> None:
        """Begin to focus on the surface in the middle of the window."""
        self.pull.start(self.surfaces.distance_at(0.5, 0.5))
        off = self.renderer.settings.dof.mode == "none"
        self.tell(
            f"Focus at {self.pull.target:.3g} m"
            + ("; depth of field is off: switch it on under dof in the panel" if off else "")
        )

    def pull_focus(self, dt: float) -> None:
        """Move the lens for `dt` seconds towards the focus distance chosen by the user or the autofocus."""
        lens = self.renderer.settings.dof
        if lens.autofocus and lens.mode != "none":
            self.pull.start(self.surfaces.distance_at(0.5, 0.5))
        self.pull.advance(lens, dt)

    def represent(self, representation: Representation | None) -> None:
        """Draw every object in `representation`; None follows the scene."""
        self.renderer.world.representation = representation
        self.tell(f"Representation: {representation_name(representation)}")


def representation_name(representation: Representation | None) -> str:
    """Return the name of `representation` in the panel; None stands for the scene's own choice."""
    return "as in the scene" if representation is None else representation.label
