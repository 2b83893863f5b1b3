# SPDX-License-Identifier: Apache-2.0
"""Optimisers with the interface of Mitsuba's: mappings of names to values, with `step`. The
steps are the library's (`imp_optimizer_step`).

For more than a first loop use `importon.fit`, which knows the error of each gradient and
ends with intervals, or an optimiser of torch or JAX (`importon.torch`, `importon.jax`).
"""
from __future__ import annotations

import ctypes
from collections.abc import Iterator, MutableMapping
from typing import Any, Optional

import numpy as np

from . import _c
from ._array import address, numbers
from ._context import failure
from ._errors import ArgumentError
from ._library import choice, explained, lib, make


class Optimizer(MutableMapping):  # type: ignore[type-arg]
    """Names and values that `step` changes: `SGD` and `Adam` are made.

    Parameters
    ----------
    kind : str
        "adam" or "sgd".
    params : mapping, optional
        Names and first values.
    **rule
        Of `struct imp_optimizer_rule`.
    """

    def __init__(self, kind: str, params: Any = None, **rule: float) -> None:
        self._rule = make(_c.imp_optimizer_rule, kind=choice("imp_rule", kind, "kind"),
                          **{k: float(v) for k, v in rule.items()})
        self._values: dict[str, Any] = {}
        self._state: dict[str, Any] = {}
        self._take(np.zeros(0), np.zeros(0), np.zeros(1))  # refuses a rule out of its range
        for name, value in dict(params or {}).items():
            self[name] = value

    @property
    def lr(self) -> float:
        """The learning rate, which may be set between steps."""
        return float(self._rule.learning_rate)

    @lr.setter
    def lr(self, value: float) -> None:
        self._rule.learning_rate = float(value)

    def _take(self, gradient: Any, x: Any, state: Any) -> None:
        status = lib.imp_optimizer_step(ctypes.byref(self._rule), x.size, address(gradient), None, None, address(state),
                                        address(x))
        if status:
            raise failure(status, lib.imp_last_error(None).decode(errors="replace"))

    def __getitem__(self, name: str) -> Any:
        return self._values[name][()]

    def __setitem__(self, name: str, value: Any) -> None:
        made = np.array(numbers(value, name))
        if name in self._values and made.shape != self._values[name].shape:
            self._state.pop(name, None)  # another quantity: its moments are new, too
        self._values[name] = made

    def __delitem__(self, name: str) -> None:
        del self._values[name]
        self._state.pop(name, None)

    def __iter__(self) -> Iterator[str]:
        return iter(self._values)

    def __len__(self) -> int:
        return len(self._values)

    def step(self, grad: Any) -> None:
        """Change the values.

        Parameters
        ----------
        grad : Loss, Gradient or mapping
            Derivatives by name, of the values' shapes.

        Raises
        ------
        ArgumentError
            A derivative has another shape, or is not finite: nothing is changed.

        Examples
        --------
        >>> opt = importon.ad.Adam(lr=0.5, params={"x": [1.0, 2.0]})
        >>> opt.step({"x": [-3.0, 0.1]})
        >>> opt["x"].round(6)
        array([1.5, 1.5])
        """
        grad = getattr(grad, "grad", grad)
        given = {name: numbers(grad[name], name) for name in self._values}
        for name, g in given.items():
            if g.shape != self._values[name].shape:
                raise ArgumentError("the derivative of %s has shape %s, not %s" % (name, g.shape, self._values[name].shape))
        values, states = {}, {}
        for name, g in given.items():
            values[name] = x = self._values[name].copy()
            before = self._state.get(name)
            states[name] = state = np.zeros(1 + 2 * x.size) if before is None else before.copy()
            self._take(g, x, state)
        self._values.update(values)
        self._state.update(states)

    def reset(self, name: str) -> None:
        """Forget the moments of a value, as before its first step.

        Parameters
        ----------
        name : str

        Examples
        --------
        >>> opt = importon.ad.SGD(lr=0.5, momentum=0.9, params={"x": 1.0})
        >>> opt.step({"x": 1.0})
        >>> opt.reset("x")
        >>> opt.step({"x": 1.0})
        >>> float(opt["x"])
        0.0
        """
        self._values[name]
        self._state.pop(name, None)


class SGD(Optimizer):
    """Gradient descent with momentum.

    Parameters
    ----------
    lr : float
        Learning rate, > 0, in units of value / gradient.
    momentum : float
        In [0, 1).
    params : mapping, optional
        Names and first values.

    Examples
    --------
    >>> opt = importon.ad.SGD(lr=0.1, params={"x": 1.0})
    >>> opt.step({"x": 2.0})
    >>> float(opt["x"])
    0.8
    """

    @explained
    def __init__(self, lr: float, momentum: float = 0, params: Any = None) -> None:
        super().__init__("sgd", params, learning_rate=lr, momentum=momentum)


class Adam(Optimizer):
    """Adam (Kingma and Ba 2015).

    Parameters
    ----------
    lr : float
        Learning rate, > 0, in the values' units.
    beta_1, beta_2 : float
        Decay of the moments, in [0, 1).
    epsilon : float
        > 0, in the gradients' units.
    params : mapping, optional
        Names and first values.

    Examples
    --------
    >>> opt = importon.ad.Adam(lr=0.1, params={"x": 1.0})
    >>> opt.step({"x": 2.0})
    >>> round(float(opt["x"]), 6)
    0.9
    """

    @explained
    def __init__(self, lr: float, beta_1: float = 0.9, beta_2: float = 0.999, epsilon: float = 1e-8,
                 params: Optional[Any] = None) -> None:
        super().__init__("adam", params, learning_rate=lr, beta1=beta_1, beta2=beta_2, epsilon=epsilon)


__all__ = ["Adam", "Optimizer", "SGD"]
