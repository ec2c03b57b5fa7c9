"""The page about walkers and agents as one system, written anew with every run."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

from agents.evaluation.closed_loop_map import GOAL_AHEAD
from agents.evaluation.closed_loop_report import (
    ClosedLoopReport,
    eigenvalue_table,
    markdown_table,
)
from agents.evaluation.closed_loop_survival import REACHES, STEPS

_HEAD = f"""# Walker and agent as one system

A benchmark's score says how well an agent does, not why. But walker and agent together, with the command held, are one dynamical system, and from
heel strike to heel strike an exact map; so it can be looked at as the paper looks at the walker alone: its periodic gait, the eigenvalues there, how
large its basin of attraction is, what it asks of the floor and what it costs.

- **The map** is the environment's own step, with its observation, mirror convention and limits. Its state is the section state, the mass offset in
  force and the heading of the footprint before (the observed error is from the mean of two); SpeedHeading's has the last speed beside, Slalom's
  the place beside a straight path. A goal is held {{goal}} leg lengths ahead. Pushes and time limit are off, the heading commanded is straight downhill.
- **The gait** is the fixed point of two steps, by Newton's method from where a long walk settles.
- **Eigenvalues** are of the two steps' Jacobian: the exact one of the walking step, composed with differences of the agent's commands (agents answer
  in single precision, so the differences choose their own step size; the bound of what that leaves uncertain is in the table). Each is named by
  the coordinates that take the largest part in it. Neutral ones, which no coordinate answers to, are apart: a heading or place that the agent does
  not use, or the mean offset where both steps change it by as much as they may.
- **Basins**: starts in two planes of the section through the walker's own gait, the same for every agent, and a box of all three coordinates, within
  {{reaches}}. A walk of {STEPS} steps is survived.
- **Pushes** change both rates at the start of a left step of the agent's own gait.

Speeds, forces and work are dimensionless: leg length, gravity and mass are one.

Renewed by

```
{{command}}
```

The numbers are in [closed_loop.csv](closed_loop.csv).
"""

_UNITS = {"ankle_angle": "rad", "stance_pitch_rate": "rad / time unit", "ankle_rate": "rad / time unit"}  # fmt: skip


def markdown_page(
    by_task: Mapping[str, Sequence[ClosedLoopReport]],
    command: str,
    picture_name: Callable[[str, str], str],
    notes: Mapping[str, str],
) -> str:
    """The page.

    Parameters
    ----------
    by_task : reports of each task
    command : the command line that renews it
    picture_name : from task and kind of picture to the file in ``images``
    notes : by "task: agent", why an agent is left out
    """
    reaches = ", ".join(
        f"{reach:g} {_UNITS[name]} of its {name.replace('_', ' ')}"
        for name, reach in REACHES.items()
    )
    parts = [_HEAD.format(command=command, reaches=reaches, goal=f"{GOAL_AHEAD:g}")]
    for task, reports in by_task.items():
        parts.append(f"## {task}\n")
        parts.append(f"{markdown_table(reports)}\n\n{eigenvalue_table(reports)}\n")
        parts += [
            f"![{words} at {task}](images/{picture_name(task, what)})\n"
            for what, words in _PICTURE_WORDS.items()
        ]
    if notes:
        parts.append("Left out:\n")
        parts.append("\n".join(f"- {what}: {why}" for what, why in notes.items()) + "\n")
    return "\n".join(parts)


_PICTURE_WORDS = {
    "eigenvalues": "Eigenvalues of the closed loop's stride in the complex plane",
    "basins": "Basins of attraction",
    "pushes": "Largest push survived in each direction of the two rates",
}
