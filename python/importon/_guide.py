# SPDX-License-Identifier: Apache-2.0
"""Solutions as guides for walks."""
from __future__ import annotations

import ctypes

from . import _c
from ._context import Handle, warn_said
from ._elements_read import ElementsRead
from ._library import explained, lib, make


class Guide:
    """What walks are told about the light, to draw from: see `guide`."""

    def __init__(self, elements: ElementsRead, handle: Handle) -> None:
        self.elements, self._handle = elements, handle

    def _guide_pointer(self) -> int:
        self.elements.pointer
        return self._handle.pointer


@explained
def guide(elements: ElementsRead, *, lights: bool = True, share: float = 0, roulette: float = 0) -> Guide:
    """A solution as a guide for walks: it changes the noise of pictures and gradients, never
    their mean.

    Parameters
    ----------
    elements : Elements
    lights : bool
        Light samples follow what every light sends to a place; light walks begin by importance.
    share : float
        Of continuations drawn towards indirect light, or importance by light walks, 0 to 1.
    roulette : float
        Russian roulette of walks from the sensor by expected contribution; 0: off.

    Returns
    -------
    Guide
        For the keyword `guide` of `importon.render`, `importon.loss`, ...

    Examples
    --------
    >>> scene = importon.load_dict(importon.cornell_box(res=8))
    >>> guide = importon.guide(importon.elements.Elements(scene, stop=0.2))
    >>> importon.render(scene, spp=4, guide=guide).shape
    (8, 8, 3)
    """
    if not isinstance(elements, ElementsRead):
        raise TypeError("a guide is made from Elements, not from a %s" % type(elements).__name__)
    options = make(_c.imp_elements_guide_options, no_lights=not lights, share=float(share), roulette=float(roulette))
    with elements.scene.lock:
        out = ctypes.c_void_p()
        elements._context.check(lib.imp_elements_guide(elements.pointer, ctypes.byref(options), ctypes.byref(out)))
        warn_said()
        return Guide(elements, Handle(out.value or 0, lib.imp_guide_destroy))
