# SPDX-License-Identifier: Apache-2.0
"""A raw photograph of a small scene, as a camera would save it: dng.py PICTURE.pfm PHOTO.dng SEED [TIME F_NUMBER ISO FOCAL_35MM]
[big|plain|mosaic]. Each pixel of the picture is 4 x 4 of a mosaic of green, red, blue and green, 16 bits, black at 512 and white at
4095; noise of light of 2000 electrons at white. `big`: bytes from the
big end; `plain`: no noise; `mosaic`: of other colours. See Adobe's DNG specification 1.4 for the tags."""
import array
import math
import random
import struct
import sys

BLACK, WHITE, ELECTRONS, PART = 512, 4095, 2000, 4
words = [w for w in sys.argv[1:] if w not in ("big", "plain", "mosaic")]
order = ">" if "big" in sys.argv else "<"
kind, size, _, data = open(words[0], "rb").read().split(b"\n", 3)
w, h = map(int, size.split())
C = 3 if kind == b"PF" else 1
light = array.array("f", data[:4 * w * h * C])
rng = random.Random(int(words[2]))
W, H = PART * w, PART * h


def code(x, y):
    colour = (1, 0, 2, 1)[2 * (y % 2) + x % 2]
    v = max(0, light[((h - 1 - y // PART) * w + x // PART) * C + (colour if C == 3 else 0)])
    if "plain" not in sys.argv:
        v = rng.gauss(v, math.sqrt(v / ELECTRONS) + 1e-3)
    return max(0, min(WHITE, round(BLACK + (WHITE - BLACK) * v)))


pixels = array.array("H", (code(x, y) for y in range(H) for x in range(W)))
if (sys.byteorder == "big") != (order == ">"):
    pixels.byteswap()


def directory(entries, at):
    """An IFD that stands at `at`, and its longer values behind it. entries: (tag, type, values)."""
    sizes = {1: ("B", 1), 2: ("B", 1), 3: ("H", 2), 4: ("I", 4), 5: ("II", 8), 10: ("ii", 8)}
    out, more = struct.pack(order + "H", len(entries)), b""
    behind = at + 2 + 12 * len(entries) + 4
    for tag, kind, values in sorted(entries):
        form, _ = sizes[kind]
        body = b"".join(struct.pack(order + form, *(v if isinstance(v, tuple) else (v,))) for v in values)
        field = body.ljust(4, b"\0") if len(body) <= 4 else struct.pack(order + "I", behind + len(more))
        more += body if len(body) > 4 else b""
        more += b"\0" if len(more) % 2 else b""
        out += struct.pack(order + "HHI", tag, kind, len(values)) + field
    return out + struct.pack(order + "I", 0) + more


def file(exif_at, pixels_at):
    model = list(b"Imitated\0")
    return directory([
        (254, 4, [0]), (256, 4, [W]), (257, 4, [H]), (258, 3, [16]), (259, 3, [1]), (262, 3, [32803]), (271, 2, model), (272, 2, model),
        (273, 4, [pixels_at]), (274, 3, [1]), (277, 3, [1]), (278, 4, [H]), (279, 4, [2 * W * H]), (284, 3, [1]), (33421, 3, [2, 2]),
        (33422, 1, [1, 0, 2, 0] if "mosaic" in sys.argv else [1, 0, 2, 1]), (34665, 4, [exif_at]), (50706, 1, [1, 4, 0, 0]), (50707, 1, [1, 1, 0, 0]), (50708, 2, model),
        (50710, 1, [0, 1, 2]), (50711, 3, [1]), (50713, 3, [1, 1]), (50714, 3, [BLACK]), (50717, 4, [WHITE]),
        (50721, 10, [(1, 1), (0, 1), (0, 1), (0, 1), (1, 1), (0, 1), (0, 1), (0, 1), (1, 1)]), (50728, 5, [(1, 1)] * 3), (50778, 3, [21])], 8)


numbers = [float(v) for v in words[3:7]]
exif_at = 8 + len(file(0, 0))
exif = directory([(0x829a, 5, [(round(1000 * numbers[0]), 1000)]), (0x829d, 5, [(round(1000 * numbers[1]), 1000)]),
                  (0x8827, 3, [int(numbers[2])]), (0xa405, 3, [int(numbers[3])])] if numbers else [], exif_at)
with open(words[1], "wb") as f:
    f.write((b"II*\0" if order == "<" else b"MM\0*") + struct.pack(order + "I", 8) + file(exif_at, exif_at + len(exif)) + exif
            + pixels.tobytes())
