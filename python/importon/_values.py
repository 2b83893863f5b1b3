# SPDX-License-Identifier: Apache-2.0
"""Numbers by parameter."""
from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from ._errors import ParameterError
from ._params import find
from ._scene import Scene


class Values(Mapping):  # type: ignore[type-arg]
    """Numbers by parameter: name -> float64 [shape of the parameter]. A name may be written
    as `SceneParameters` takes it."""

    def __init__(self, scene: Scene, values: dict[str, Any]) -> None:
        self._scene, self._values = scene, values

    def __getitem__(self, name: str) -> Any:
        if name in self._values:
            return self._values[name]
        full = find(self._scene, name).name
        if full not in self._values:
            raise ParameterError("%s was not active" % full)
        return self._values[full]

    def __iter__(self) -> Iterator[str]:
        return iter(self._values)

    def __len__(self) -> int:
        return len(self._values)

    def __repr__(self) -> str:
        return "{%s}" % ",\n ".join("%r: %s" % kv for kv in self._values.items())


class Gradient(Values):
    """Derivatives by parameter; `se` has one standard error of each number."""

    def __init__(self, scene: Scene, values: dict[str, Any], se: dict[str, Any]) -> None:
        super().__init__(scene, values)
        self.se = Values(scene, se)
