# SPDX-License-Identifier: Apache-2.0
"""Optimisers with the interface of Mitsuba's: mappings of names to values, with `step`.

For more than a first loop use `importon.fit`, which knows the error of each gradient and
ends with intervals, or an optimiser of torch or JAX (`importon.torch`, `importon.jax`).
"""
from __future__ import annotations

from collections.abc import Iterator, MutableMapping
from typing import Any, Optional

import numpy as np


class Optimizer(MutableMapping):  # type: ignore[type-arg]
    """Names and values that `step` changes.

    Parameters
    ----------
    lr : float
        Learning rate, in the units of the values.
    params : mapping, optional
        Names and first values.
    """

    def __init__(self, lr: float, params: Any = None) -> None:
        self.lr = lr
        self.t = 0
        self.values_: dict[str, Any] = {}
        self.state: dict[str, Any] = {}
        for name, value in dict(params or {}).items():
            self[name] = value

    def __getitem__(self, name: str) -> Any:
        return self.values_[name]

    def __setitem__(self, name: str, value: Any) -> None:
        self.values_[name] = np.array(value, dtype=np.float64)[()]

    def __delitem__(self, name: str) -> None:
        del self.values_[name]
        self.state.pop(name, None)

    def __iter__(self) -> Iterator[str]:
        return iter(self.values_)

    def __len__(self) -> int:
        return len(self.values_)

    def step(self, grad: Any) -> None:
        """Change the values.

        Parameters
        ----------
        grad : Loss, Gradient or mapping
            Derivatives by name.
        """
        grad = getattr(grad, "grad", grad)
        self.t += 1
        for name, value in self.values_.items():
            self.values_[name] = value - self.lr * self._direction(name, np.asarray(grad[name], dtype=np.float64))

    def _direction(self, name: str, g: Any) -> Any:
        raise NotImplementedError


class SGD(Optimizer):
    """Stochastic gradient descent, with momentum.

    Parameters
    ----------
    lr : float
    momentum : float
    params : mapping, optional

    Examples
    --------
    >>> opt = importon.ad.SGD(lr=0.1, params={"x": 1.0})
    >>> opt.step({"x": 2.0})
    >>> float(opt["x"])
    0.8
    """

    def __init__(self, lr: float, momentum: float = 0, params: Any = None) -> None:
        super().__init__(lr, params)
        self.momentum = momentum

    def _direction(self, name: str, g: Any) -> Any:
        self.state[name] = self.momentum * self.state.get(name, 0.0) + g
        return self.state[name]


class Adam(Optimizer):
    """Adam (Kingma and Ba 2015).

    Parameters
    ----------
    lr : float
    beta_1, beta_2, epsilon : float
    params : mapping, optional

    Examples
    --------
    >>> opt = importon.ad.Adam(lr=0.1, params={"x": 1.0})
    >>> opt.step({"x": 2.0})
    >>> round(float(opt["x"]), 6)
    0.9
    """

    def __init__(self, lr: float, beta_1: float = 0.9, beta_2: float = 0.999, epsilon: float = 1e-8,
                 params: Optional[Any] = None) -> None:
        super().__init__(lr, params)
        self.beta_1, self.beta_2, self.epsilon = beta_1, beta_2, epsilon

    def _direction(self, name: str, g: Any) -> Any:
        t, m, v = self.state.get(name, (0, 0.0, 0.0))
        t, m, v = t + 1, self.beta_1 * m + (1 - self.beta_1) * g, self.beta_2 * v + (1 - self.beta_2) * g * g
        self.state[name] = t, m, v
        return m / (1 - self.beta_1**t) / (np.sqrt(v / (1 - self.beta_2**t)) + self.epsilon)
