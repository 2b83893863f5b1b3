# SPDX-License-Identifier: Apache-2.0
"""The operators of `importon.torch` in PyTorch's graphs: pictures, losses and bent rays, with their derivatives."""
from __future__ import annotations

from typing import Any

import numpy as np
import torch
from torch import Tensor

from ._errors import ArgumentError
from ._functional import known


def _on_cpu(*tensors: Tensor) -> None:
    for t in tensors:
        if t.device.type != "cpu":
            raise ArgumentError("a tensor is on device %s: copy it to the CPU first" % t.device)


def _array(t: Tensor) -> Any:
    return t.detach().to(torch.float64).contiguous().numpy()


def _refuse(ctx: Any, *grads: Any) -> Any:
    raise NotImplementedError("importon: a second derivative is not available")


# ---- Pictures ----------------------------------------------------------------------


@torch.library.custom_op("importon::render", mutates_args=(), device_types="cpu")
def _render(x: Tensor, key: int, seed: int, seed_grad: int) -> Tensor:
    return torch.from_numpy(np.array(known(key).picture(_array(x), seed)))


@_render.register_fake
def _(x: Tensor, key: int, seed: int, seed_grad: int) -> Tensor:
    return x.new_empty(known(key).shape, dtype=torch.float32)


@torch.library.custom_op("importon::render_backward", mutates_args=(), device_types="cpu")
def _render_backward(grad: Tensor, x: Tensor, key: int, seed: int) -> Tensor:
    return torch.from_numpy(known(key).backward(_array(x), grad.detach().contiguous().numpy(), seed)).to(x.dtype)


@_render_backward.register_fake
def _(grad: Tensor, x: Tensor, key: int, seed: int) -> Tensor:
    return torch.empty_like(x)


def _render_setup(ctx: Any, inputs: Any, output: Any) -> None:
    x, ctx.key, _, ctx.seed_grad = inputs
    ctx.save_for_backward(x)


def _render_vjp(ctx: Any, grad: Tensor) -> Any:
    (x,) = ctx.saved_tensors
    return _render_backward(grad, x, ctx.key, ctx.seed_grad), None, None, None


_render.register_autograd(_render_vjp, setup_context=_render_setup)
_render_backward.register_autograd(_refuse)


# ---- Losses ------------------------------------------------------------------------


@torch.library.custom_op("importon::loss", mutates_args=(), device_types="cpu")
def _loss(x: Tensor, key: int, seed: int, gradient: bool) -> tuple[Tensor, Tensor]:
    value, g = known(key).loss(_array(x), seed, gradient)
    return torch.tensor(value, dtype=torch.float64), torch.from_numpy(g).to(x.dtype)


@_loss.register_fake
def _(x: Tensor, key: int, seed: int, gradient: bool) -> tuple[Tensor, Tensor]:
    return x.new_empty((), dtype=torch.float64), torch.empty_like(x)


@torch.library.custom_op("importon::loss_backward", mutates_args=(), device_types="cpu")
def _loss_backward(grad: Tensor, g: Tensor) -> Tensor:
    return (grad * g).to(g.dtype)


@_loss_backward.register_fake
def _(grad: Tensor, g: Tensor) -> Tensor:
    return torch.empty_like(g)


def _loss_setup(ctx: Any, inputs: Any, output: Any) -> None:
    ctx.save_for_backward(output[1])
    ctx.gradient = inputs[3]


def _loss_vjp(ctx: Any, grad: Tensor, _: Any) -> Any:
    if not ctx.gradient:
        raise RuntimeError("importon: this loss was computed without its gradient")
    (g,) = ctx.saved_tensors
    return _loss_backward(grad, g), None, None, None


_loss.register_autograd(_loss_vjp, setup_context=_loss_setup)
_loss_backward.register_autograd(_refuse)


# ---- Bent rays ---------------------------------------------------------------------


@torch.library.custom_op("importon::bend", mutates_args=(), device_types="cpu")
def _bend(theta: Tensor, origins: Tensor, directions: Tensor, key: int) -> tuple[Tensor, Tensor, Tensor]:
    e = known(key).trace(_array(theta), _array(origins), _array(directions))
    return tuple(torch.from_numpy(np.array(a)) for a in (e.x, e.v, e.path))  # type: ignore[return-value]


@_bend.register_fake
def _(theta: Tensor, origins: Tensor, directions: Tensor, key: int) -> tuple[Tensor, Tensor, Tensor]:
    n = origins.shape[0]
    return tuple(theta.new_empty(s, dtype=torch.float64) for s in ((n, 3), (n, 3), (n,)))  # type: ignore[return-value]


@torch.library.custom_op("importon::bend_backward", mutates_args=(), device_types="cpu")
def _bend_backward(theta: Tensor, origins: Tensor, directions: Tensor, x_bar: Tensor, v_bar: Tensor, path_bar: Tensor,
                   key: int) -> tuple[Tensor, Tensor, Tensor]:
    g = known(key).backward(*(_array(t) for t in (theta, origins, directions, x_bar, v_bar, path_bar)))
    return tuple(torch.from_numpy(a).to(t.dtype)  # type: ignore[return-value]
                 for a, t in zip(g, (theta, origins, directions)))


@_bend_backward.register_fake
def _(theta: Tensor, origins: Tensor, directions: Tensor, x_bar: Tensor, v_bar: Tensor, path_bar: Tensor,
      key: int) -> tuple[Tensor, Tensor, Tensor]:
    return torch.empty_like(theta), torch.empty_like(origins), torch.empty_like(directions)


def _bend_setup(ctx: Any, inputs: Any, output: Any) -> None:
    theta, origins, directions, ctx.key = inputs
    ctx.save_for_backward(theta, origins, directions)


def _bend_vjp(ctx: Any, x_bar: Tensor, v_bar: Tensor, path_bar: Tensor) -> Any:
    return (*_bend_backward(*ctx.saved_tensors, x_bar, v_bar, path_bar, ctx.key), None)


_bend.register_autograd(_bend_vjp, setup_context=_bend_setup)
_bend_backward.register_autograd(_refuse)
