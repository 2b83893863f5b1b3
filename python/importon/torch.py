# SPDX-License-Identifier: Apache-2.0
"""Pictures, losses and bent rays in PyTorch's graphs, for any optimiser.

The functions are custom operators (`torch.library`), so they work under `torch.compile` and
`no_grad`. A second derivative is refused. Tensors lie on the CPU; a picture is float32, a
loss float64.
"""
from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Optional

import torch
from torch import Tensor

from ._array import numbers
from ._errors import ArgumentError
from ._functional import Function, RayFunction, other_seed, rest_of
from ._torch_ops import _bend, _loss, _on_cpu, _render


# ---- Functions of dictionaries -----------------------------------------------------


class Renderer:
    """A picture as a function of a dictionary of tensors, made once: its calls are one
    operator, which `torch.compile(fullgraph=True)` takes.

    Parameters
    ----------
    scene : Scene
    names : iterable of str
        Parameters that its calls are given.
    sensor, spp, spp_grad, drop_budget, guide, wavelengths, wavelength_set, points
        As `render`'s.
    **loss
        Of losses, which `importon.torch.loss` makes.

    Examples
    --------
    >>> scene = importon.load_dict(importon.cornell_box(res=8))
    >>> renderer = importon.torch.Renderer(scene, ["red.reflectance.value"], spp=4)
    >>> renderer({"red.reflectance.value": torch.tensor([0.5, 0.1, 0.1])}).shape
    torch.Size([8, 8, 3])
    """

    def __init__(self, scene: Any, names: Any, *, sensor: Any = 0, spp: int = 0, spp_grad: int = 0,
                 drop_budget: float = 0, guide: Any = None, wavelengths: str = "stratified", wavelength_set: int = 0, points: str = "scene",
                 **loss: Any) -> None:
        names = list(names)
        rest = rest_of(drop_budget, guide, wavelengths, wavelength_set, points)
        self.function = Function(scene, names, sensor, spp, spp_grad, rest, **loss)
        self.key = self.function.key
        from ._params import find
        order = {i.name: k for k, i in enumerate(self.function.infos)}
        self.given = sorted(names, key=lambda n: order[find(self.function.scene, n).name])
        self.counts = [i.size for i in self.function.infos]
        self.shapes = [i.shape for i in self.function.infos]
        self.full = dict(zip(self.given, self.function.names))

    def flat(self, values: Mapping[str, Tensor]) -> Tensor:
        """All numbers in one tensor, in the scene's order.

        Parameters
        ----------
        values : mapping of str to Tensor
            As those of its calls.

        Returns
        -------
        Tensor
            float64 [n].

        Examples
        --------
        >>> scene = importon.load_dict(importon.cornell_box(res=8))
        >>> renderer = importon.torch.Renderer(scene, ["red.reflectance.value"], spp=4)
        >>> renderer.flat({"red.reflectance.value": torch.tensor(0.5)})
        tensor([0.5000, 0.5000, 0.5000], dtype=torch.float64)
        """
        if len(values) != len(self.given):
            raise ArgumentError("%d values are given, %d parameters were named" % (len(values), len(self.given)))
        parts = []
        for name, count, shape in zip(self.given, self.counts, self.shapes):
            v = values[name]
            v = v if isinstance(v, Tensor) else torch.as_tensor(v)
            if v.device.type != "cpu":
                raise ArgumentError("%s is on device %s: copy it to the CPU first" % (name, v.device))
            if not v.dtype.is_floating_point:
                raise ArgumentError("%s has dtype %s: real numbers are wanted" % (name, v.dtype))
            if tuple(v.shape) != shape and v.numel() != 1:
                raise ArgumentError("%s has shape %s, not %s" % (name, tuple(v.shape), shape))
            parts.append(v.to(torch.float64).reshape(-1).expand(count))
        return torch.cat(parts)

    def __call__(self, values: Mapping[str, Tensor], seed: int = 0, seed_grad: Optional[int] = None) -> Tensor:
        x = self.flat(values)
        # Seeds are signed where they pass through a graph.
        made: Tensor = _render(x, self.key, _signed(seed),
                               _signed(other_seed(seed) if seed_grad is None else seed_grad))
        return made


def _signed(seed: int) -> int:
    """A seed as the graph's 64-bit integer; Function gives it to C without its sign."""
    seed = int(seed)
    if not 0 <= seed < 2**64:
        raise ArgumentError("seed = %d is outside [0, 2^64)" % seed)
    return seed & (2**63 - 1)


_recent: dict[Any, Any] = {}


def _cached(key: Any, make: Any, hold: Any) -> Any:
    """Of a few functions used last, so that a loop makes one; `hold` keeps what ids name."""
    found = _recent.pop(key, None) or (make(), hold)
    _recent[key] = found
    while len(_recent) > 32:
        del _recent[next(iter(_recent))]
    return found[0]


@torch.compiler.disable  # type: ignore[untyped-decorator,unused-ignore]
def _renderer(scene: Any, names: tuple[str, ...], **options: Any) -> Renderer:
    cache = scene.__dict__.setdefault("_torch", {})
    key = (names, tuple(sorted((k, id(v) if k == "guide" else v) for k, v in options.items())))
    if key not in cache:
        cache[key] = Renderer(scene, names, **options)
    made: Renderer = cache[key]
    return made


def render(scene: Any, values: Mapping[str, Tensor], *, sensor: Any = 0, spp: int = 0, seed: int = 0,
           seed_grad: Optional[int] = None, spp_grad: int = 0, drop_budget: float = 0, guide: Any = None,
           wavelengths: str = "stratified", wavelength_set: int = 0, points: str = "scene") -> Tensor:
    """A picture as a function of parameters.

    Parameters
    ----------
    scene : Scene
        Its parameters are set to `values`.
    values : mapping of str to Tensor
        Of the parameter's shape, or one number.
    sensor, spp, seed, drop_budget, guide, wavelengths, wavelength_set, points
        As `importon.render`'s.
    seed_grad, spp_grad : int, optional
        Of the backward pass. By default its random numbers are others than the picture's:
        an adjoint image made from the same walks would give a biased gradient.

    Returns
    -------
    Tensor
        float32 [height][width][channels].

    Raises
    ------
    ArgumentError
        A value is out of bounds, not finite, of another shape, or on a GPU.
    BiasError
        A parameter has no unbiased derivative.

    Examples
    --------
    >>> scene = importon.load_dict(importon.cornell_box(res=8))
    >>> x = torch.tensor([0.5, 0.1, 0.1], requires_grad=True)
    >>> importon.torch.render(scene, {"red.reflectance.value": x}, spp=4).sum().backward()
    >>> x.grad.shape
    torch.Size([3])
    """
    r: Renderer = _renderer(scene, tuple(values), sensor=sensor, spp=spp, spp_grad=spp_grad, drop_budget=drop_budget,
                            guide=guide, wavelengths=wavelengths, wavelength_set=wavelength_set, points=points)
    return r(values, seed, seed_grad)


def loss(scene: Any, target: Any, values: Mapping[str, Tensor], *, spp: int = 0, seed: int = 0, sensor: Any = 0,
         loss: str = "l2", epsilon: float = 0, weights: Any = None, drop_budget: float = 0, guide: Any = None,
         wavelengths: str = "stratified", wavelength_set: int = 0, points: str = "scene") -> Tensor:
    """A loss as a function of parameters: value and gradient from one pass, each walk
    compared with the mean of the others, so without bias for quadratic losses.

    Parameters
    ----------
    scene, target, spp, seed, sensor, loss, epsilon, weights, drop_budget, guide, wavelengths,
    wavelength_set, points
        As `importon.loss`'s. `target` may be a tensor.
    values : mapping of str to Tensor
        As `render`'s.

    Returns
    -------
    Tensor
        float64 scalar.

    Examples
    --------
    >>> scene = importon.load_dict(importon.cornell_box(res=8))
    >>> target = importon.render(scene, spp=16, seed=1)
    >>> x = torch.tensor([0.5, 0.1, 0.1], requires_grad=True)
    >>> importon.torch.loss(scene, target, {"red.reflectance.value": x}, spp=4).backward()
    >>> x.grad.shape
    torch.Size([3])
    """
    r: Renderer = _losses(scene, target, tuple(values), spp, sensor, loss, epsilon, weights, drop_budget, guide,
                          wavelengths, wavelength_set, points)
    x = r.flat(values)
    value: Tensor = _loss(x, r.key, _signed(seed), torch.is_grad_enabled() and x.requires_grad)[0]
    return value


@torch.compiler.disable  # type: ignore[untyped-decorator,unused-ignore]
def _losses(scene: Any, target: Any, names: tuple[str, ...], spp: int, sensor: Any, loss: str, epsilon: float,
            weights: Any, drop_budget: float, guide: Any, wavelengths: str = "stratified", wavelength_set: int = 0,
            points: str = "scene") -> Renderer:
    def make() -> Renderer:
        t = target.detach().cpu().numpy() if isinstance(target, Tensor) else target
        return Renderer(scene, names, sensor=sensor, spp=spp, drop_budget=drop_budget, guide=guide,
                        wavelengths=wavelengths, wavelength_set=wavelength_set, points=points, target=t, loss=loss,
                        epsilon=epsilon, weights=weights)

    key = (id(scene), id(target), names, spp, sensor, loss, epsilon, id(weights), drop_budget, id(guide), wavelengths,
           wavelength_set, points)
    made: Renderer = _cached(key, make, (scene, target, weights, guide))
    return made


# ---- Bent rays ---------------------------------------------------------------------


def bend(field: Any, theta: Tensor, origins: Tensor, directions: Tensor, **options: Any) -> tuple[Tensor, Tensor, Tensor]:
    """Where bent rays end, as a function of field and rays (`importon.bend.trace`).

    Parameters
    ----------
    field : importon.bend.Field
        Its numbers are set to `theta`.
    theta : Tensor
        [n_theta]
    origins, directions : Tensor
        [n][3]
    **options
        As `importon.bend.trace`'s.

    Returns
    -------
    x, v, path : Tensor
        float64 [n][3], [n][3], [n]; rays that were lost have no derivative.

    Examples
    --------
    >>> field = importon.bend.Field.profile("luneburg", [1, 0, 0, 0])
    >>> theta = torch.tensor(field.theta, requires_grad=True)
    >>> x, v, path = importon.torch.bend(field, theta, torch.tensor([[0, 0.3, -0.9539]]), torch.tensor([[0.0, 0, 1]]),
    ...                                  surfaces=[{"type": "sphere", "radius": 1}], step=0.01)
    >>> path.sum().backward()
    >>> theta.grad.shape
    torch.Size([4])
    """
    f = _rays(field, options)
    theta, origins, directions = (t if isinstance(t, Tensor) else torch.as_tensor(numbers(t, "rays"))
                                  for t in (theta, origins, directions))
    _on_cpu(theta, origins, directions)
    made: tuple[Tensor, Tensor, Tensor] = _bend(theta, origins, directions, f.key)
    return made


@torch.compiler.disable  # type: ignore[untyped-decorator,unused-ignore]
def _rays(field: Any, options: dict[str, Any]) -> RayFunction:
    cache = field.__dict__.setdefault("_functions", {})
    key = repr(sorted(options.items(), key=lambda kv: kv[0]))
    if key not in cache:
        cache[key] = RayFunction(field, options)
    made: RayFunction = cache[key]
    return made


__all__ = ["Renderer", "bend", "loss", "render"]
