"""Named failures, each saying what to do about it."""

from __future__ import annotations


class LeanYawError(Exception):
    """Base of every error that is the walker's own."""


class FellError(LeanYawError):
    """A walker fell where a completed step was needed; try a steeper slope, a smaller disturbance or a smaller command."""


class NoGaitError(LeanYawError):
    """No limit cycle was found; the message lists what was tried. Try a steeper slope or a smaller inter-leg angle or offset."""


class SolverError(LeanYawError):
    """The integrator gave up, which is a fault of the solver and not a fall; please report the message, which reproduces it.

    Known only of springs or dampers that move an ankle next to without inertia (hip width below 0.05, small ankle tilt) more than a thousand
    times faster than it walks: soften them.
    """


class NoGpuError(LeanYawError, RuntimeError):
    """``device="cuda"`` was asked for where no GPU can be used. The default ``device="cpu"`` gives the same results."""


class ClusterError(LeanYawError):
    """A scheduler or a worker could not do its part; the message names it. What was done before is kept, where the work has a store."""
