"""Find by trial the resolution and number of layers with which an object reaches a PSNR, for `compare --want-psnr`."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import product

from depthwalk.bake.params import ModelParams
from depthwalk.bake.parts import bake_model
from depthwalk.ingest.mesh import Mesh
from depthwalk.quality import metrics
from depthwalk.quality.pair_renderer import PairRenderer
from depthwalk.quality.views import FEW, Viewpoint
from depthwalk.scene.render_settings import RenderSettings

RESOLUTIONS = 256, 512, 1024
LAYERS = 1, 2, 3, 4, 6, 8
LEAST_GAIN = 0.1  # dB; if more layers gain less, no further ones are tried


@dataclass(frozen=True, kw_only=True)
class Trial:
    """Hold the result of baking with one resolution and one number of layers.

    Attributes
    ----------
    resolution
        Width and height of the depth images, texels.
    layers
        Number of surfaces sampled along each ray.
    psnr
        Mean PSNR over the views, dB.
    bytes_gpu
        Bytes of GPU memory that the depth images take.
    """

    resolution: int
    layers: int
    psnr: float
    bytes_gpu: int


@dataclass(frozen=True, kw_only=True)
class Recommendation:
    """Recommend the cheapest trial that reaches a PSNR, or otherwise the best of all.

    Attributes
    ----------
    wanted
        The PSNR to reach, dB.
    views
        Number of views over which the PSNR of a trial is averaged.
    reached
        Whether `best` reaches `wanted`.
    best
        The recommended trial.
    trials
        All trials, by ascending number of texels.
    """

    wanted: float
    views: int
    reached: bool
    best: Trial
    trials: tuple[Trial, ...]

    def text(self) -> str:
        """Return the recommendation in one line."""
        best = self.best
        values = f"{best.psnr:.1f} dB in {self.views} views, {best.bytes_gpu / 1e6:.1f} MB on the GPU"
        options = f"--dpci-resolution {best.resolution} --layers {best.layers}"
        if self.reached:
            return f"for {self.wanted:g} dB: {options} ({values})"
        return f"{self.wanted:g} dB is out of reach; best is {options} ({values})"


def recommend(
    mesh: Mesh,
    params: ModelParams,
    settings: RenderSettings,
    size: tuple[int, int],
    wanted: float,
    viewpoints: Sequence[Viewpoint] = FEW,
    resolutions: Sequence[int] = RESOLUTIONS,
    progress: Callable[[str], None] = lambda stage: None,
) -> Recommendation:
    """Bake a mesh with more and more texels until its mean PSNR is high enough.

    Parameters
    ----------
    mesh
        The mesh, asset frame, metres.
    params
        Parts and axis of the bakes. Resolution and layers are varied; surfaces are sampled by ray casting.
    settings
        How mesh and depth images are rendered.
    size
        Width and height of the pictures, pixels.
    wanted
        The PSNR to reach, dB.
    viewpoints
        The views to average over.
    resolutions
        Widths of depth images to try, texels.
    progress
        Called with a text that describes the trial that begins.

    Returns
    -------
    Recommendation
        The recommended trial, and all others.

    Raises
    ------
    GpuError
        If no OpenGL 3.3 context can be created.
    """
    trials: list[Trial] = []
    for resolution, layers in _by_cost(resolutions, trials):
        progress(f"trying {resolution}², {layers} layers")
        baked = bake_model(mesh, replace(params, resolution=resolution, layers=layers, method="raycast"), key="")
        with PairRenderer(mesh, baked, settings, size) as renderer:
            trials.append(
                Trial(
                    resolution=resolution,
                    layers=layers,
                    psnr=mean_psnr(renderer, viewpoints),
                    bytes_gpu=renderer.gpu_bytes,
                )
            )
        if trials[-1].psnr >= wanted:
            return Recommendation(
                wanted=wanted, views=len(viewpoints), reached=True, best=trials[-1], trials=tuple(trials)
            )
    best = max(trials, key=lambda trial: trial.psnr)
    return Recommendation(wanted=wanted, views=len(viewpoints), reached=False, best=best, trials=tuple(trials))


def mean_psnr(renderer: PairRenderer, viewpoints: Sequence[Viewpoint]) -> float:
    """Return the mean PSNR, dB, of the depth images that `renderer` draws against their mesh.

    It is the mean over those `viewpoints` that show anything, and +inf if none does.
    """
    values = []
    for viewpoint in viewpoints:
        pair = renderer.pair(viewpoint)
        union = pair.mesh.covered | pair.dpci.covered
        if union.any():
            values.append(metrics.psnr(pair.mesh.pixels, pair.dpci.pixels, union))
    return sum(values) / len(values) if values else float("inf")


def _by_cost(resolutions: Sequence[int], trials: Sequence[Trial]) -> Iterator[tuple[int, int]]:
    """Yield resolution and layers to try next, by number of texels: resolution² · layers.

    A resolution is abandoned when its last step in layers gained less than `LEAST_GAIN`.
    """
    for side, layers in sorted(product(resolutions, LAYERS), key=lambda pair: (pair[0] ** 2 * pair[1], pair[0])):
        same = [trial for trial in trials if trial.resolution == side]
        exhausted = len(same) < LAYERS.index(layers) or (len(same) > 1 and same[-1].psnr - same[-2].psnr < LEAST_GAIN)
        if not exhausted:
            yield side, layers
