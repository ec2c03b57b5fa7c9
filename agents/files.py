"""JSON files that hold plain values only, written whole or not at all."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

from lean_yaw_env.files import written_whole

_INFINITIES = {"inf": math.inf, "-inf": -math.inf}


def write_json(path: Path, value: Any) -> None:
    """Write a value as JSON that every reader of JSON takes; infinite numbers as the strings "inf" and "-inf"."""
    text = json.dumps(_plain(value), indent=2, allow_nan=False) + "\n"
    with written_whole(path) as temporary:
        temporary.write_text(text, encoding="utf-8")


def read_json(path: Path) -> Any:
    """Read JSON as ``write_json`` writes it, or raise ``ValueError`` naming the file."""
    try:
        return _unplain(json.loads(path.read_text(encoding="utf-8")))
    except FileNotFoundError as error:
        raise ValueError(f"there is no file {str(path)!r}") from error
    except (UnicodeDecodeError, json.JSONDecodeError, RecursionError) as error:
        raise ValueError(f"{str(path)!r} is not JSON: {error}") from error


def _plain(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _plain(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(item) for item in value]
    if isinstance(value, float) and math.isinf(value):
        return "inf" if value > 0.0 else "-inf"
    return value


def _unplain(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _unplain(item) for key, item in value.items()}
    if isinstance(value, list):
        return [_unplain(item) for item in value]
    return _INFINITIES.get(value, value) if isinstance(value, str) else value
