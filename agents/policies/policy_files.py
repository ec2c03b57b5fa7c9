"""Policies on disk: ``policy.json`` says what it is, ``policy.safetensors`` holds its numbers; neither can hold code."""

from __future__ import annotations

import hashlib
from dataclasses import asdict, fields
from pathlib import Path
from typing import Any

from lean_yaw_env.envs.options import EnvOptions
from lean_yaw_env.extras import needs_extra
from lean_yaw_env.files import read_json, read_regular, require_path, write_json, written_whole
from lean_yaw_env.parameters import WalkerParameters
from lean_yaw_env.registration import ALL_ENV_IDS, GOAL_ENV_ID, NAMESPACE, TASK_IDS
from lean_yaw_env.validation import require_instance, require_seed, require_text

from ..observations import ObservationLayout
from .policy import Policy, PolicyCard, require_algorithm

CARD_FILE = "policy.json"
WEIGHTS_FILE = "policy.safetensors"
FORMAT = "lean-yaw-policy"
FORMAT_VERSION = 1
SHIPPED = Path(__file__).parents[1] / "trained"
"""Agents that come with the package, as ``<Task>-v<version>/<algorithm>/seed<k>/``."""
DEFAULT_ALGORITHM = "ppo"
"""Whose agent is meant where none is named."""
_MOST_WEIGHTS = 2**28  # bytes: a thousand times the largest that is trained here

_CARD_KEYS: dict[str, type] = {
    "algorithm": str,
    "activation": str,
    "output": str,
    "seed": int,
    "settings": dict,
    "training": dict,
    "versions": dict,
}
"""Fields of a ``PolicyCard`` that the file holds as they are."""
_KEYS: dict[str, type] = {
    "format": str,
    "format_version": int,
    "env_id": str,
    "options": dict,
    "observation": dict,
    **_CARD_KEYS,
    "weights_sha256": str,
}


class PolicyFileError(ValueError):
    """Files that hold no policy for this package's environments; the message says what is wrong and what to do."""


def save(policy: Policy, folder: Path) -> None:
    """Write a policy into a folder, which is made if it is not there; each file whole, the weights first."""
    card = require_instance("policy", policy, Policy).card
    folder = require_path(folder, "folder")
    folder.mkdir(parents=True, exist_ok=True)
    data = _safetensors().numpy.save(policy.weights)
    with written_whole(folder / WEIGHTS_FILE) as temporary:
        temporary.write_bytes(data)
    record = {
        "format": FORMAT,
        "format_version": FORMAT_VERSION,
        "env_id": card.env_id,
        "options": options_to_plain(card.options),
        "observation": asdict(card.layout),
        **{key: getattr(card, key) for key in _CARD_KEYS},
        "weights_sha256": hashlib.sha256(data).hexdigest(),
    }
    write_json(folder / CARD_FILE, record)


def load(
    source: str | Path,
    *,
    env_id: str | None = None,
    algorithm: str | None = None,
    seed: int | None = None,
) -> Policy:
    """Load a policy: numbers and names only; no code from the files is run.

    Parameters
    ----------
    source : an environment's id, for the agent that comes with the package, or a folder
    env_id : the environment that the policy is wanted for; any by default
    algorithm : that trained the policy; by default PPO for the package's agents (HER for WaypointGoal), and any for a folder
    seed : of the package's agent for that id and algorithm; the lowest one by default

    Raises
    ------
    PolicyFileError
        If there is no policy, a file is damaged or not of this format, or it was trained for another environment or version, on
        other observations or by another algorithm.
    gymnasium.error.DependencyNotInstalled
        If safetensors is not installed.
    """
    name = str(require_path(source, "source"))
    seed = require_seed("seed", seed)
    for argument, value in (("env_id", env_id), ("algorithm", algorithm)):
        if value is not None:
            require_text(argument, value)
    if name.startswith(f"{NAMESPACE}/"):
        require_env_id(name)
        folder = shipped_folder(
            name, algorithm or ("her" if name == GOAL_ENV_ID else DEFAULT_ALGORITHM), seed
        )
        env_id = name if env_id is None else env_id
    else:
        folder = Path(source)
    try:
        card, digest = _read_card(folder / CARD_FILE)
        if env_id is not None and card.env_id != env_id:
            raise ValueError(
                f"the policy was trained for the env_id {card.env_id!r}, not for {env_id!r}; train one for it by train.py"
            )
        if algorithm is not None and card.algorithm != algorithm:
            raise ValueError(
                f"the policy was trained by the algorithm {card.algorithm!r}, not by {algorithm!r}"
            )
        return Policy(card, _read_weights(folder / WEIGHTS_FILE, digest))
    except PolicyFileError:
        raise
    except (ValueError, TypeError) as error:
        raise PolicyFileError(f"no policy can be loaded from {str(folder)!r}: {error}") from error


def shipped_seeds(env_id: str, algorithm: str = DEFAULT_ALGORITHM) -> list[int]:
    """The seeds, in order, of the agents that come with the package for an environment's id and an algorithm; empty for none."""
    require_text("env_id", env_id)
    require_text("algorithm", algorithm)
    folders = shipping_folder(env_id, algorithm, 0).parent.glob("seed*")
    names = [folder.name.removeprefix("seed") for folder in folders]
    return sorted(int(name) for name in names if name.isdecimal())


def shipped_folder(
    env_id: str, algorithm: str = DEFAULT_ALGORITHM, seed: int | None = None
) -> Path:
    """The folder of an agent that comes with the package, of the lowest seed by default, or ``PolicyFileError`` if there is none."""
    for each in shipped_seeds(env_id, algorithm):
        if seed is None or each == seed:
            return shipping_folder(env_id, algorithm, each)
    wanted = "" if seed is None else f" with seed {seed}"
    raise PolicyFileError(
        f"no agent of the algorithm {algorithm!r} for {env_id}{wanted} comes with this package; train one by train.py"
    )


def shipping_folder(env_id: str, algorithm: str, seed: int) -> Path:
    """Where an agent of the package is kept, whether it is there or not; ``PolicyFileError`` for a bad name."""
    try:
        home = SHIPPED / env_id.removeprefix(f"{NAMESPACE}/") / require_algorithm(algorithm)
    except ValueError as error:
        raise PolicyFileError(str(error)) from error
    return home / f"seed{seed}"


def require_env_id(env_id: str) -> str:
    """The id of an environment of this package, or ``PolicyFileError`` that says what to do."""
    if env_id in ALL_ENV_IDS:
        return env_id
    name, _, _ = env_id.partition("-v")
    versions = [known for known in ALL_ENV_IDS if known.startswith(f"{name}-v")]
    if versions:
        raise PolicyFileError(
            f"this package's environment is {versions[0]}, not {env_id}: their observations or rewards differ; "
            "train a policy anew or install the package that trained it"
        )
    raise PolicyFileError(f"env_id must be one of {', '.join(ALL_ENV_IDS)}, got {env_id!r}")


def task_of(env_id: str) -> str:
    """The task's name in an environment's id."""
    return TASK_IDS.get(env_id) or env_id.removeprefix(f"{NAMESPACE}/").partition("-v")[0]


def options_to_plain(options: EnvOptions) -> dict[str, Any]:
    """The options that are not the default's, as plain values."""
    plain = _changed(options)
    if options.parameters is not None:
        plain["parameters"] = _changed(options.parameters)
    return plain


def options_from_plain(plain: dict[str, Any]) -> EnvOptions:
    """The options that ``options_to_plain`` wrote, or ``ValueError``."""
    values = dict(_known("options", plain, EnvOptions))
    if "parameters" in values:
        values["parameters"] = WalkerParameters(
            **_known("parameters", values["parameters"], WalkerParameters)
        )
    return EnvOptions(**values)


def _changed(record: Any) -> dict[str, Any]:
    default = type(record)()
    return {
        field.name: getattr(record, field.name)
        for field in fields(record)
        if getattr(record, field.name) != getattr(default, field.name)
    }


def _known(name: str, values: Any, record: type) -> dict[str, Any]:
    names = [field.name for field in fields(record)]
    if not isinstance(values, dict) or not set(values) <= set(names):
        raise ValueError(f"{name} must hold {', '.join(names)} only, got {values!r}")
    return values


def _read_card(path: Path) -> tuple[PolicyCard, str]:
    """What the JSON says, checked, and the digest of the weights."""
    values = read_json(path)
    if not isinstance(values, dict) or values.get("format") != FORMAT:
        raise ValueError(f"{path.name} is not a policy's: its format must be {FORMAT!r}")
    if values.get("format_version") != FORMAT_VERSION:
        raise ValueError(
            f"{path.name} has format version {values.get('format_version')!r}, and this package reads {FORMAT_VERSION}"
        )
    if set(values) != set(_KEYS):
        raise ValueError(f"{path.name} must hold {', '.join(_KEYS)}; not {', '.join(values)}")
    for key, kind in _KEYS.items():
        if not isinstance(values[key], kind) or isinstance(values[key], bool):
            raise ValueError(f"{path.name}: {key} must be of type {kind.__name__}")
    env_id = require_env_id(values["env_id"])
    options = options_from_plain(values["options"])
    layout = ObservationLayout.of(task_of(env_id), options)
    now = {key: list(value) for key, value in asdict(layout).items()}
    if values["observation"] != now:
        raise ValueError(
            f"it was trained on other observations, {values['observation']}, than {env_id} now gives, {now}; train a policy anew"
        )
    card = PolicyCard(env_id, options, layout, **{key: values[key] for key in _CARD_KEYS})
    return card, values["weights_sha256"]


def _read_weights(path: Path, digest: str) -> dict[str, Any]:
    try:
        data = read_regular(path, _MOST_WEIGHTS)
    except OSError as error:
        raise ValueError(f"{path.name} cannot be read: {error}") from error
    if hashlib.sha256(data).hexdigest() != digest:
        raise ValueError(f"{path.name} is not the file that {CARD_FILE} was written with")
    library = _safetensors()
    try:
        return library.numpy.load(data)
    except library.SafetensorError as error:
        raise ValueError(f"{path.name} is damaged: {error}") from error
    except (KeyError, AttributeError, TypeError) as error:  # numpy has no such numbers
        raise ValueError(f"{path.name} must hold float32 numbers, got {error}") from error


def _safetensors() -> Any:
    """The library, imported when a policy is read or written: other agents do without."""
    with needs_extra("agents"):
        import safetensors
        import safetensors.numpy
    return safetensors
