"""The environments' tables for the documents, made from the code so that they cannot disagree with it.

``python -m lean_yaw_env.envs.describe docs/environments.md`` renews the tables of that page: what stands between the marks
``<!-- NAME -->`` and ``<!-- end -->``.
"""

from __future__ import annotations

import inspect
import re
import sys
from pathlib import Path

from lean_yaw_env.envs.info import INFOS, OPTIONAL_INFOS
from lean_yaw_env.envs.observation import (
    OBSERVATION_LIMIT,
    OFFSET_SCALE,
    STATE_CENTRES,
    STATE_SCALES,
)
from lean_yaw_env.envs.options import EnvOptions
from lean_yaw_env.envs.reset import BODY_DEVIATIONS, HELD_OUT_REACH, START_DEVIATIONS
from lean_yaw_env.envs.state import BODY_NAMES
from lean_yaw_env.envs.tasks import Task, task_named
from lean_yaw_env.files import write_text
from lean_yaw_env.parameters import INTER_LEG_ANGLE, PARAMETER_NAMES, STATE_FIELDS
from lean_yaw_env.registration import NAMESPACE, TASK_VERSIONS
from lean_yaw_env.tables import markdown_table


def describe_observation() -> str:
    """What every task observes."""
    rows = [
        (k, field.name, field.unit, f"{centre:g}", f"{scale:g}", field.description)
        for k, (field, centre, scale) in enumerate(
            zip(STATE_FIELDS, STATE_CENTRES, STATE_SCALES, strict=True)
        )
    ]
    rows.append((5, "mass_offset", "leg lengths", "0", f"{OFFSET_SCALE:g}", "mass offset in force"))
    rows.append((6, "stance_foot", "", "0", "1", "+1 left, -1 right; only with `mirror=False`"))
    return markdown_table(("number", "name", "unit", "centre", "scale", "meaning"), rows)


def describe_action() -> str:
    """What an action means with the options' defaults."""
    options = EnvOptions()
    middle, turn, reach = INTER_LEG_ANGLE, options.inter_leg_angle_range, options.mass_offset_range
    angle = f"inter-leg angle, {middle} + {turn} a0 rad"
    offset = (
        f"mass offset, {reach:g} a1 leg lengths, positive to the right of a left stance (and its mirror image of a right one), as far as "
        "the largest change per step allows"
    )
    rows = (
        (0, angle, f"{middle - turn:g} to {middle + turn:g} rad"),
        (1, offset, f"-{reach:g} to {reach:g}"),
    )
    return markdown_table(("number", "sets", "range"), rows)


def describe_start() -> str:
    """How far a start is from the gait, and what bodies are drawn."""
    start = markdown_table(
        ("coordinate", "largest deviation"),
        (
            (field.name, f"{reach:g} {field.unit}")
            for field, reach in zip(STATE_FIELDS, START_DEVIATIONS, strict=True)
        ),
    )
    bodies = markdown_table(
        ("parameter", "training", "held out, outside the training box"),
        (
            (name, f"within {reach:g}", f"within {HELD_OUT_REACH * reach:g}")
            for name, reach in zip(PARAMETER_NAMES, BODY_DEVIATIONS, strict=False)
        ),
    )
    return f"{start}\n\n{bodies}"


def describe_options() -> str:
    """Every constructor argument, from the options' own documentation."""
    text = inspect.getdoc(EnvOptions) or ""
    section = text.split("Parameters\n----------\n")[1].split("\n\nRaises\n")[0]
    rows = []
    for entry in re.split(r"\n(?=\S)", section):
        head, *body = entry.split("\n")
        name, kind = head.split(" : ")
        default = getattr(EnvOptions(), name)
        meaning = " ".join(line.strip() for line in body).replace("``", "`")
        rows.append((f"`{name}`", f"`{default}`", kind, meaning))
    return markdown_table(("option", "default", "values", "meaning"), rows)


def describe_info() -> str:
    """The contents of every task's ``info``."""
    infos = ((f"`{info.key}`", info.unit, info.meaning) for info in (*INFOS, *OPTIONAL_INFOS))
    return markdown_table(("key", "unit", "meaning"), infos)


def describe_task(task: Task) -> str:
    """One task: what it asks, its observation, reward and metrics."""
    body = task.parameters
    slope = f"{body.slope:g} rad" + (", turning with the walker" if body.slope_turns else "")
    slope += ", varying" if task.slope_varies else ""
    facts = [
        ("slope", slope),
        ("friction limit", f"{body.friction_limit:g}"),
        ("horizon", f"{task.horizon:g} units of time (truncation)"),
        ("ends", "; ".join(filter(None, ("a fall, a termination without reward", task.ends)))),
        ("reward per unit of time", task.reward_text),
        ("largest change of offset per step", f"{task.max_offset_change:g}"),
        ("push level", f"{task.push_level:g}"),
        ("start", f"pumping by {task.pumping:g}" if task.pumping else "the gait on the slope"),
    ]
    if task.random_body != "nominal":
        box = zip(BODY_NAMES, task.body_reach, strict=True)
        within = ", ".join(f"{name} within {reach:g}" for name, reach in box)
        facts.append(("bodies", f"`{task.random_body}`: {within} of the middle"))
    if task.hidden_rates:
        facts.append(("rates", "hidden: shown as zero"))
    for name, command in task.commands.items():
        bounds = f"each in [{command.low:.4g}, {command.high:.4g}]"
        facts.append((f"reset option `{name}`", f"{command.meaning}; {bounds}"))
    facts.append(("versions", " ".join(task.history)))
    parts = [task.summary, markdown_table(("", ""), facts)]
    observed = [(f.name, f.unit, f"{f.centre:g}", f"{f.scale:g}", f.meaning) for f in task.observed]
    if observed:
        parts.append("Observed after the common numbers:")
        parts.append(markdown_table(("name", "unit", "centre", "scale", "meaning"), observed))
    parts.append("Success, in `info`:")
    parts.append(
        markdown_table(("key", "meaning"), [(f"`{k}`", m.meaning) for k, m in task.metrics.items()])
    )
    return "\n\n".join(parts)


def sections() -> dict[str, str]:
    """Every generated part of the page, by the name in its mark."""
    parts = {
        "observation": f"Clipped to +-{OBSERVATION_LIMIT:g}.\n\n{describe_observation()}",
        "action": describe_action(),
        "start": describe_start(),
        "options": describe_options(),
        "info": describe_info(),
    }
    for name, version in TASK_VERSIONS.items():
        title = f"### {NAMESPACE}/{name}-v{version}"
        parts[name] = f"{title}\n\n{describe_task(task_named(name))}"
    return parts


def renewed(page: str) -> str:
    """The page with its generated parts as the code has them.

    Raises
    ------
    ValueError
        If the page lacks the marks of a part, or has marks of none.
    """
    parts = sections()
    pattern = re.compile(r"<!-- (\S+) -->\n.*?<!-- end -->", re.DOTALL)
    marked = [match[1] for match in pattern.finditer(page)]
    if sorted(marked) != sorted(parts):
        raise ValueError(
            f"the page must mark each of {', '.join(parts)} once; it marks {', '.join(marked)}"
        )
    return pattern.sub(lambda match: f"<!-- {match[1]} -->\n{parts[match[1]]}\n<!-- end -->", page)


def main(path: str) -> None:
    """Renew a page's generated parts in place."""
    write_text(Path(path), renewed(Path(path).read_text(encoding="utf-8")))


if __name__ == "__main__":
    main(sys.argv[1])
