"""Files of this workspace that hold one JSON object, which names its schema."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from pendulum_twin.errors import BadInputError


def read_json_object(path: Path, schema: str, what: str) -> dict[str, Any]:
    """Return the object in a file; what: how a person calls such a file. Raises BadInputError when it is none."""
    expected = f"{path}: expected {what} with schema {schema}"
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError) as error:
        raise BadInputError(f"{expected}, but it cannot be read: {error}") from error
    if not isinstance(content, dict) or content.get("schema") != schema:
        raise BadInputError(f"{expected}, found another file")
    return content
