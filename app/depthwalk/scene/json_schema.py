"""Generate the JSON schema of scene files, for completion and checks in editors.

`python -m depthwalk.scene.json_schema [FILE]` writes it.
"""

import json
import sys
from pathlib import Path
from typing import Any

from depthwalk.files import write_bytes
from depthwalk.resources import scene_root
from depthwalk.scene.schema import SceneFile

FILE_NAME = "scene.schema.json"


def scene_json_schema() -> dict[str, Any]:
    """Return the JSON schema (draft 2020-12) of a scene file."""
    schema = SceneFile.model_json_schema()
    schema.update({"$schema": "https://json-schema.org/draft/2020-12/schema", "title": "depthwalk scene"})
    return schema


def scene_json_text() -> str:
    """Return the text of the shipped file: the JSON schema of a scene file, indented."""
    return json.dumps(scene_json_schema(), indent=2, ensure_ascii=False) + "\n"


def main() -> None:
    """Write the schema to the file given as argument, or else over the shipped one."""
    target = Path(sys.argv[1]) if len(sys.argv) > 1 else scene_root() / FILE_NAME
    write_bytes(target, scene_json_text().encode())


if __name__ == "__main__":
    main()
