"""The walking step on a GPU, a thread for each walker: the formulas of ``step``, and what CUDA lacks for them. It needs the extra ``gpu``.

CUDA's simulator (``NUMBA_ENABLE_CUDASIM=1``) calls the formulas from Python, so that it needs ``NUMBA_DISABLE_JIT=1`` too.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from llvmlite import ir
from numba import config
from numpy.typing import NDArray

from lean_yaw_env.errors import NoGpuError
from lean_yaw_env.extras import needs_extra
from lean_yaw_env.kernel.lanes import row_reader
from lean_yaw_env.kernel.records import FAILED, Outcome, SectionState
from lean_yaw_env.kernel.step import (
    body_of,
    command_of,
    quick_step,
    walk_carefully,
    write_outcome,
)

with needs_extra("gpu"):
    import numba_cuda  # noqa: F401  (without it, numba.cuda is a part of Numba that is no longer developed)
    from numba import cuda
    from numba.cuda.extending import lower_builtin

Rows = NDArray[np.float64]
_config: Any = config  # its type hints do not know it
IS_SIMULATED: bool = bool(_config.ENABLE_CUDASIM)
THREADS = 4 if IS_SIMULATED else 128
"""Threads of a block."""
# Link-time optimisation would fuse products and sums again
_OPTIONS: dict[str, Any] = {} if IS_SIMULATED else {"lto": False}
_STATUS = Outcome._fields.index("status")

state_of = row_reader(SectionState)


def _lower_to(intrinsic: str, function: Any) -> None:
    """Compile one of NumPy's functions of a number, which CUDA does not know, as an intrinsic of LLVM's."""

    @lower_builtin(function, cuda.types.float64)
    def _(context, builder, signature, arguments):
        own = builder.module.declare_intrinsic(intrinsic, [ir.DoubleType()])
        return builder.call(own, arguments)


_lower_to("llvm.floor", np.floor)
_lower_to("llvm.ceil", np.ceil)
_lower_to("llvm.sqrt", np.sqrt)


def require_gpu() -> None:
    """Raise ``NoGpuError`` unless there is a GPU, or CUDA's simulator."""
    if IS_SIMULATED and not _config.DISABLE_JIT:
        raise NoGpuError("CUDA's simulator needs NUMBA_DISABLE_JIT=1 beside NUMBA_ENABLE_CUDASIM=1")
    if not cuda.is_available():
        raise NoGpuError(
            "device='cuda' needs an NVIDIA GPU with its driver, and there is none that the extra 'gpu' (numba-cuda) can use; "
            "leave device='cpu'"
        )


def is_device_array(value: Any) -> bool:
    """Whether it is an array of numba-cuda's."""
    return bool(getattr(value, "__cuda_ndarray__", False))


def kernel(function: Any) -> Any:
    """Decorate what a thread does: it is compiled for the GPU when it is first launched."""
    return cuda.jit(function, **_OPTIONS)


def launch(function: Any, n: int, *arguments: Any) -> None:
    """Launch a kernel with a thread for each of ``n`` walkers."""
    function[-(-n // THREADS), THREADS](*arguments)


def _stepping(has_own_bodies: bool) -> Any:
    """A kernel that steps walkers, but those to skip; a step whose landing is not found is left as ``FAILED``.

    Known beforehand: whether each walker has a body of its own. What derives from a body that all share is kept outside a thread's registers.
    """

    @kernel
    def step_rows(bodies, commands, states, sides, skip, outcomes):
        i = cuda.grid(1)
        if i < len(states) and not skip[i]:
            body = body_of(bodies[i if has_own_bodies else 0])
            outcome = quick_step(body, command_of(commands[i]), state_of(states[i]), sides[i])
            write_outcome(outcome, outcomes[i])

    return step_rows


step_rows, step_rows_of_own_bodies = _stepping(False), _stepping(True)


@kernel
def step_rows_carefully(bodies, commands, states, sides, skip, outcomes):
    """Step walkers again whose steps have come out as ``FAILED``: apart, as a kernel that does both needs more registers than there are."""
    i = cuda.grid(1)
    if i < len(states) and not skip[i] and outcomes[i, _STATUS] == FAILED:
        body = body_of(bodies[i if len(bodies) > 1 else 0])
        outcome = walk_carefully(body, command_of(commands[i]), state_of(states[i]), sides[i])
        write_outcome(outcome, outcomes[i])


def step_all(*rows: Any) -> None:
    """Step walkers whose ``bodies``, ``commands``, ``states``, ``sides``, ``skip`` and ``outcomes`` are on the device."""
    bodies, n = rows[0], len(rows[-1])
    launch(step_rows_of_own_bodies if len(bodies) > 1 else step_rows, n, *rows)
    launch(step_rows_carefully, n, *rows)


def step_batch(bodies: Rows, commands: Rows, states: Rows, sides: Rows) -> Rows:
    """The outcomes (n, 18) of walkers, whose rows are copied to the device and back; arguments as of ``batch.step_batch``."""
    require_gpu()
    n = len(states)
    outcomes = cuda.device_array((n, len(Outcome._fields)), dtype=np.float64)
    rows = (bodies, commands, states, sides, np.zeros(n, dtype=np.bool_))
    step_all(*(cuda.to_device(np.ascontiguousarray(each)) for each in rows), outcomes)
    return outcomes.copy_to_host()
