"""Two operations with derivatives of their own: a computation whose Jacobian is known, and a bound that lets one back in."""

from __future__ import annotations

from typing import Any

import torch
from torch import Tensor
from torch.autograd import Function
from torch.autograd.function import once_differentiable


class _Known(Function):
    """Values computed elsewhere, with the Jacobian that goes with them."""

    @staticmethod
    def forward(ctx: Any, inputs: Tensor, values: Tensor, jacobians: Tensor) -> Tensor:
        ctx.save_for_backward(jacobians)
        return values.clone()

    @staticmethod
    @once_differentiable
    def backward(ctx: Any, gradient: Tensor) -> tuple[Tensor, None, None]:
        (jacobians,) = ctx.saved_tensors
        return torch.einsum("nk,nkj->nj", gradient, jacobians), None, None


def with_known_jacobians(inputs: Tensor, values: Tensor, jacobians: Tensor) -> Tensor:
    """``values``, which a compiled computation made of ``inputs``, as a differentiable function of them.

    Parameters
    ----------
    inputs : shape (n, j)
    values : shape (n, k)
    jacobians : shape (n, k, j)
        The derivatives of ``values`` by ``inputs``.
    """
    return _Known.apply(inputs, values, jacobians)  # pyright: ignore[reportReturnType]


class _Bounded(Function):
    @staticmethod
    def forward(ctx: Any, value: Tensor, middle: Tensor, reach: float) -> Tensor:
        low, high = middle - reach, middle + reach
        ctx.save_for_backward(value < low, value > high)
        return torch.minimum(torch.maximum(value, low), high)

    @staticmethod
    @once_differentiable
    def backward(ctx: Any, gradient: Tensor) -> tuple[Tensor, Tensor, None]:
        below, above = ctx.saved_tensors
        by_value = torch.where(below, gradient.clamp(max=0.0), gradient)
        by_value = torch.where(above, gradient.clamp(min=0.0), by_value)
        return by_value, torch.where(below | above, gradient, 0.0), None


def bounded(value: Tensor, middle: Tensor, reach: float) -> Tensor:
    """``value`` kept within ``reach`` of ``middle``, each of shape (n,), with a derivative for descent on a loss.

    The true derivative by a value that is out of bounds is zero, from which descent never comes back. Here it is that at the bound
    where descent would bring the value back, and zero where it would lead further out, as in a projected gradient.
    """
    return _Bounded.apply(value, middle, reach)  # pyright: ignore[reportReturnType]
