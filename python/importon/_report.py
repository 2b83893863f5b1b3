# SPDX-License-Identifier: Apache-2.0
"""Results as one HTML page."""
from __future__ import annotations

import ctypes
import json
from collections.abc import Mapping, Sequence
from typing import Any, Optional

from . import _c
from ._context import context
from ._errors import ArgumentError
from ._library import integer, lib, make, text
from ._picture import to_film

_KEYS = ("kind", "name", "role", "unit", "view", "picture", "json", "image")


def report(path: Any, items: Sequence[Any], *, title: Optional[str] = None, command: Optional[str] = None) -> None:
    """Write a result as one HTML page that opens anywhere: pictures with their errors, and data.

    The page needs no network and loads nothing (docs/report.md).

    Parameters
    ----------
    path : str or PathLike
        The page appears whole or not at all.
    items : sequence of Picture, array or dict
        Pictures; or dictionaries with "picture", "json" (any value that JSON has, or its text) or
        "image" (bytes of a PNG or SVG file), "kind" ("picture", "derivative", "image"; "fit",
        "check", ... for the JSON that these commands write; of others the page lists the values),
        "name", "role" ("target" or "picture", which the page compares), "unit" and "view"
        (pictures of one view are flipped in place).
    title, command : str, optional
        What stands above; how the result was made, to be copied.

    Raises
    ------
    TypeError
        A dictionary has another key.
    ArgumentError
        An item has not exactly one of picture, JSON and image, or JSON that does not parse.
    FileError
        The file cannot be written.

    Examples
    --------
    >>> picture = importon.render(importon.load_dict(importon.cornell_box(res=8)), spp=4)
    >>> importon.report("box.html", [{"picture": picture, "name": "the box"}], title="A box")
    >>> "A box" in open("box.html").read()
    True
    """
    ctx = context()
    rows: list[Any] = []
    kept: list[Any] = []
    for item in items:
        d = dict(item) if isinstance(item, Mapping) else {"picture": item}
        for key in d:
            if key not in _KEYS:
                raise TypeError("an item has no '%s'; it has: %s" % (key, ", ".join(_KEYS)))
        picture, data, image = d.get("picture"), d.get("json"), d.get("image")
        if picture is None and image is None and "json" not in d:
            raise ArgumentError("an item has none of 'picture', 'json' and 'image'")
        film = None if picture is None else to_film(picture, ctx)
        if "json" in d and not isinstance(data, str):
            data = json.dumps(data)
        kind = d.get("kind") or ("image" if image is not None else "derivative" if getattr(picture, "signed", False)
                                 else "picture")
        row = make(_c.imp_report_item, view=integer(d.get("view", 0), "view"), film=None if film is None else film.pointer)
        if image is not None:
            data_of = bytes(image)
            row.image_size, row.image = len(data_of), ctypes.cast(ctypes.c_char_p(data_of), ctypes.c_void_p)
            kept.append(data_of)
        for field, value in (("kind", kind), ("name", d.get("name")), ("role", d.get("role")), ("unit", d.get("unit")),
                             ("json", data)):
            setattr(row, field, None if value is None else text(value, field))
        rows.append(row)
        kept.append(film)
    array = (_c.imp_report_item * max(len(rows), 1))(*rows)
    page = make(_c.imp_report, n_items=len(rows), items=ctypes.addressof(array),
                title=None if title is None else text(title, "title"),
                command=None if command is None else text(command, "command"))
    ctx.check(lib.imp_report_write(ctx.pointer, ctypes.byref(page), text(path, "path")))
    del kept
