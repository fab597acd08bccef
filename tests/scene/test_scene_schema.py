"""The JSON schema that editors complete scene files from."""

from pathlib import Path

from depthwalk.scene.json_schema import FILE_NAME, scene_json_schema, scene_json_text

SHIPPED = Path(__file__).resolve().parents[2] / "scenes" / FILE_NAME


def test_the_shipped_schema_is_up_to_date() -> None:
    assert SHIPPED.read_text(encoding="utf-8") == scene_json_text(), "run `python -m depthwalk.scene.json_schema`"


def test_items_are_one_of_four_kinds() -> None:
    schema = scene_json_schema()
    branches = schema["properties"]["objects"]["items"]["oneOf"]
    models = [schema["$defs"][branch["$ref"].rsplit("/", 1)[1]] for branch in branches]
    assert [model["required"] for model in models] == [["asset"], ["grid"], ["group"], ["places"], ["scatter"]]
    assert all(model["additionalProperties"] is False and model["description"] for model in models)


def test_every_field_is_described() -> None:
    schema = scene_json_schema()
    for node in [schema, *schema["$defs"].values()]:
        for name, field in node.get("properties", {}).items():
            assert field.get("description") or "$ref" in field, f"{node['title']}.{name}"
