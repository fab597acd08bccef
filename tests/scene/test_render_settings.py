"""The typed render settings."""

from typing import Any

import pytest
from pydantic import ValidationError

from depthwalk.errors import InputError
from depthwalk.params import Params
from depthwalk.scene.effect_settings import ShadowParams
from depthwalk.scene.render_settings import RenderSettings


@pytest.mark.parametrize(
    ("written", "read"),
    [
        ("2 GiB", 2 << 30),
        ("500 MB", 500_000_000),
        ("1.5kB", 1500),
        ("64B", 64),
        ("2G", 2 * 10**9),
        ("12", 12),
        (12, 12),
    ],
)
def test_sizes_have_units(written: str | int, read: int) -> None:
    assert RenderSettings(gpu_memory=written).gpu_memory == read  # type: ignore[arg-type]  # the file's text


@pytest.mark.parametrize("written", ["2 GP", "-1 MB", "", True, 1.5, -1, "100000 TiB", "9" * 310 + " B"])
def test_sizes_that_are_none(written: Any) -> None:
    with pytest.raises(ValidationError):
        RenderSettings(gpu_memory=written)


def test_every_setting_has_help_in_a_sentence_and_a_default() -> None:
    def fields(model: type[Params], prefix: str) -> None:
        for name, field in model.model_fields.items():
            inner = field.annotation
            assert not field.is_required(), prefix + name
            if isinstance(inner, type) and issubclass(inner, Params):
                assert inner.__doc__, prefix + name
                fields(inner, f"{prefix}{name}.")
            else:
                assert field.description and field.description[0].isupper(), prefix + name
                assert not field.description.endswith("."), prefix + name

    fields(RenderSettings, "render.")


def test_assignments_are_checked() -> None:
    settings = RenderSettings()
    with pytest.raises(InputError):
        settings.lod.bias = 100
    with pytest.raises(InputError):
        settings.aa = "blur"  # type: ignore[assignment]
    assert settings == RenderSettings()


def test_casters_may_be_coarser_than_asked() -> None:
    assert ShadowParams(error=0.5).worst_error > 0.5
