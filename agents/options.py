"""Options of the environment as they are typed: ``NAME=VALUE``."""

from __future__ import annotations

import json
from collections.abc import Iterable
from typing import Any

from lean_yaw_env.envs.options import EnvOptions
from lean_yaw_env.validation import require_choice


def env_options(given: Iterable[str]) -> EnvOptions:
    """Options from texts as ``hidden_rates=true``, ``sensor_noise=0.1``, ``random_body=training`` or ``parameters={"foot_radius": 0.3}``.

    A value is JSON, or else a word.

    Raises
    ------
    ValueError
        If a text has no equals sign, names no option or one twice, or a value is outside its range.
    """
    values: dict[str, Any] = {}
    for text in given:
        name, equals, value = text.partition("=")
        if not equals:
            raise ValueError(f"option must be as NAME=VALUE, got {text!r}")
        require_choice("option", name, EnvOptions.__dataclass_fields__)
        if name in values:
            raise ValueError(f"option {name!r} must be given once, got it again as {text!r}")
        try:
            values[name] = json.loads(value)
        except json.JSONDecodeError:
            values[name] = value
    return EnvOptions(**values)
