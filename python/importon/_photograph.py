# SPDX-License-Identifier: Apache-2.0
"""Files of pictures as photographs: the numbers that they hold, and the levels at which these are clipped."""
from __future__ import annotations

from typing import Any, Optional

import numpy as np

from ._errors import ArgumentError


def is_path(target: Any) -> bool:
    return isinstance(target, (str, bytes)) or hasattr(target, "__fspath__")


def _tiff_bits(path: Any, order: Any) -> int:
    """Bits of a value, negative of floats, 0 of a DNG, by the first directory: entries of 12 bytes, tag 258 bits, 339 the
    format, 50706 DNG's version."""
    with open(path, "rb") as file:
        data = file.read()

    def number(at: int, n: int) -> int:
        return int.from_bytes(data[at:at + n], order)

    bits, real, start = 8, False, number(4, 4)
    for at in range(start + 2, min(start + 2 + 12 * number(start, 2), len(data) - 11), 12):
        if number(at, 2) == 50706:
            return 0
        if number(at, 2) in (258, 339):
            v = number(at + 8 if number(at + 4, 4) <= 2 else number(at + 8, 4), 2)
            bits, real = (v, real) if number(at, 2) == 258 else (bits, v == 3)
    return -bits if real else bits


def integers_of(path: Any) -> Optional[tuple[bool, int]]:
    """Of a file of integers, which `read` takes for sRGB: is it JPEG, and its largest number."""
    with open(path, "rb") as file:
        head = file.read(1024)
    if head[:2] in (b"PF", b"Pf", b"#?") or head[:4] == b"\x76\x2f\x31\x01" or head[:3] == b"VOL":
        return None
    if head[:6] == b"\x93NUMPY":
        return (False, 65535) if b"'<u2'" in head else (False, 255) if b"'|u1'" in head or b"'<u1'" in head else None
    if head[:4] == b"\x89PNG":
        return False, 65535 if head[24] == 16 else 255
    if head[:4] in (b"II*\0", b"MM\0*"):
        bits = _tiff_bits(path, "little" if head[:1] == b"I" else "big")
        return None if bits <= 0 else (False, 65535 if bits == 16 else 255)
    if head[:2] in (b"P5", b"P6"):
        words = b"\n".join(line.split(b"#")[0] for line in head.split(b"\n")).split()  # without comments
        return False, int(words[3]) if len(words) > 3 and words[3].isdigit() else 255
    return head[:2] == b"\xff\xd8", 255


def srgb_encode(v: Any) -> Any:
    """sRGB, from linear."""
    v = np.asarray(v, float)
    return np.where(v <= 0.0031308, 12.92 * v, 1.055 * np.maximum(v, 1e-9) ** (1 / 2.4) - 0.055)


def srgb_decode(v: float) -> float:
    return v / 12.92 if v <= 0.04045 else float(((v + 0.055) / 1.055) ** 2.4)


# Below and above all numbers.
_ENDS = (-float(np.finfo(np.float32).max), float(np.finfo(np.float32).max))


def is_raw(path: Any) -> bool:
    """A DNG, which is clipped at 1."""
    with open(path, "rb") as file:
        head = file.read(4)
    return head in (b"II*\0", b"MM\0*") and _tiff_bits(path, "little" if head[:1] == b"I" else "big") == 0


def levels(target: Any, clip: Any, photograph: bool) -> tuple[float, float]:
    """Levels of clipping in the target's numbers."""
    file = integers_of(target) if is_path(target) else None
    if clip == "auto" and is_path(target) and is_raw(target):
        return _ENDS[0], 1.
    if isinstance(clip, str):
        if clip != "auto" or file is None:
            raise ArgumentError("clip=%r: 'auto' is of files of integers; else (low, high) in the file's numbers" % (clip,))
        part = (5 if file[0] else 0.5) / file[1]
        pair = [part, 1 - part]
    elif len(clip) != 2:
        raise ArgumentError("clip=%r: (low, high) is wanted" % (clip,))
    else:
        pair = [bound if v is None else float(v) for v, bound in zip(clip, _ENDS)]
    if file is not None and not photograph:
        pair = [v if v in _ENDS else srgb_decode(v) for v in pair]
    return pair[0], pair[1]
