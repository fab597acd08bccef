"""What of glTF files is not read."""

from typing import Any

import pytest

from depthwalk.ingest.gltf_unread import unread


def test_each_kind_is_counted() -> None:
    header: dict[str, Any] = {
        "animations": [{}, {}],
        "cameras": [{}],
        "extensions": {"KHR_lights_punctual": {"lights": [{}, {}, {}]}},
        "materials": [
            {"normalTexture": {}, "pbrMetallicRoughness": {"metallicRoughnessTexture": {}}},
            {"normalTexture": {}, "occlusionTexture": {}, "extensions": {"KHR_materials_unlit": {}}},
        ],
        "samplers": [{"wrapS": 10497}, {}, {"wrapT": 33071}],
    }
    assert unread(header) == [
        "2 animations",
        "1 camera",
        "3 lamps",
        "2 normal maps with other texture coordinates than the colours",
        "1 occlusion map",
        "1 roughness map with other texture coordinates than the colours, but for its mean",
        "1 unlit material among others",
        "1 sampler that does not repeat",
    ]


@pytest.mark.parametrize(
    "header",
    [
        {},
        {"animations": 3, "cameras": {}, "extensions": [], "materials": [3], "samplers": [[]]},
        {"extensions": {"KHR_lights_punctual": 3}, "materials": [{"pbrMetallicRoughness": 3, "extensions": 3}]},
    ],
)
def test_what_is_malformed_counts_as_none(header: dict[str, Any]) -> None:
    assert unread(header) == []
