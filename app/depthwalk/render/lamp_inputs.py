"""Upload the lamps that reach a picture, for the shaders that light with shaders/light/lamps.glsl."""

from dataclasses import replace
from typing import Any

from depthwalk.gpu.device import Scope
from depthwalk.gpu.instances import RecordTexture
from depthwalk.params import Memo
from depthwalk.render.frame import Frame
from depthwalk.render.lighting.light_clusters import (
    LAMP_RECORD,
    NUMBERS_RECORD,
    LightClusters,
    lamp_table,
    visible_lamps,
)
from depthwalk.render.lod.selection import error_at_a_metre
from depthwalk.render.pixel_pass import PixelInputs
from depthwalk.render.shadows.sun_uniforms import LampMaps


class LampInputs:
    """Hold the lamps of a frame in textures.

    Parameters
    ----------
    gl : owns the textures.
    """

    def __init__(self, gl: Scope) -> None:
        self._table = Memo(lamp_table)
        self._records = RecordTexture(gl, LAMP_RECORD)
        self._lists = RecordTexture(gl, NUMBERS_RECORD)
        self._cells = RecordTexture(gl, NUMBERS_RECORD)

    def of(self, frame: Frame) -> PixelInputs | None:
        """Upload the lamps that reach anything in the view of `frame`.

        Returns
        -------
        The defines `LAMPS`, `LAMP_SHADOWS` and those of the maps, textures and uniforms; None where no lamp reaches
        anything.
        """
        if not frame.environment.lights:
            return None
        lamps = visible_lamps(frame.view, self._table.of(frame.environment.lights), frame.shadows.tiles)
        if not len(lamps.records):
            return None
        self._upload(lamps)
        inputs = PixelInputs(
            defines=("LAMPS",),
            textures={"lamps": self._records, "lamp_lists": self._lists, "lamp_cells": self._cells},
            uniforms={"squares": lamps.across},
        )
        if (maps := frame.targets.lamp_maps) is None:
            return inputs
        uniforms = _map_uniforms(maps) | {"seen_error": error_at_a_metre(frame.view, frame.common.lod)}
        return replace(
            inputs,
            defines=(*inputs.defines, "LAMP_SHADOWS", *maps.defines),
            textures={**inputs.textures, "lamp_maps": maps.texture},
            uniforms={**inputs.uniforms, **uniforms},
        )

    def _upload(self, lamps: LightClusters) -> None:
        for texture, records in (
            (self._records, lamps.records),
            (self._lists, lamps.lists),
            (self._cells, lamps.cells),
        ):
            texture.upload(records)


def _map_uniforms(maps: LampMaps) -> dict[str, Any]:
    """Return the uniforms by which the shadow maps of lamps are looked up."""
    params = maps.params
    return {
        "lamp_map_columns": maps.texture.width // params.lamp_resolution,
        "lamp_map_resolution": params.lamp_resolution,
        "error": params.worst_error,
    }
