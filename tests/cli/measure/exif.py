# SPDX-License-Identifier: Apache-2.0
"""Grey photographs with EXIF, PNG of 8 bits or TIFF of 16: exif.py NAME.png|NAME.tif WIDTH HEIGHT LEVEL
[TIME F_NUMBER ISO FOCAL_35MM | broken KIND]; LEVEL of 255."""
import random
import struct
import sys
import zlib


def chunk(name, data):
    return struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))


def block(time, f_number, iso, focal):
    """A TIFF file: IFD 0 points to the EXIF IFD, numbers behind it (EXIF 2.3, 4.6)."""
    entries, at = [], 26 + 2 + 4 * 12 + 4
    numbers = b""
    for tag, value in ((0x829a, time), (0x829d, f_number)):
        entries.append(struct.pack("<HHII", tag, 5, 1, at + len(numbers)))
        numbers += struct.pack("<II", round(value * 1000), 1000)
    for tag, value in ((0x8827, iso), (0xa405, focal)):
        entries.append(struct.pack("<HHIHH", tag, 3, 1, int(value), 0))
    return (b"II*\0" + struct.pack("<I", 8) + struct.pack("<HHHIII", 1, 0x8769, 4, 1, 26, 0)
            + struct.pack("<H", len(entries)) + b"".join(entries) + struct.pack("<I", 0) + numbers)


def broken(kind):
    good, rng = bytearray(block(.1, 4, 100, 48)), random.Random(kind)
    if kind == 0:
        return b""
    if kind == 1:
        return bytes(good[:30])
    if kind == 2:
        good[22:26] = struct.pack("<I", 8)  # the IFD is its own
    if kind == 3:
        good[30:36] = struct.pack("<HI", 5, 0xffffffff)  # four thousand million rationals
    if kind == 4:
        good[4:8] = struct.pack("<I", 0xfffffff0)
    if kind == 5:
        good[-16:] = struct.pack("<IIII", 0, 0, 0, 0)  # 0/0
    if kind > 5:
        for _ in range(12):
            good[rng.randrange(8, len(good))] = rng.randrange(256)
    return bytes(good)


def tiff(data):
    """The same directory for the picture, whose pixels stand behind all numbers."""
    pixels = b"".join(struct.pack("<H", 257 * level + rng.randrange(-800, 800)) for _ in range(width * height))
    fields = [(256, 4, width), (257, 4, height), (258, 3, 16), (259, 3, 1), (262, 3, 1), (273, 4, None), (277, 3, 1), (278, 4, height),
              (279, 4, len(pixels)), (0x8769, 4, None)]
    start = 8 + 2 + 12 * len(fields) + 4
    more = data[26:]  # the EXIF directory, whose places move along
    count = struct.unpack("<H", more[:2])[0]
    entries = [list(struct.unpack("<HHII", more[2 + 12 * k:14 + 12 * k])) for k in range(count)]
    for e in entries:
        e[3] += start - 26 if e[1] == 5 else 0
    more = more[:2] + b"".join(struct.pack("<HHII", *e) for e in entries) + more[2 + 12 * count:]
    places = {273: start + len(more), 0x8769: start}
    table = b"".join(struct.pack("<HHII", tag, kind, 1, places.get(tag, value)) for tag, kind, value in fields)
    return b"II*\0" + struct.pack("<IH", 8, len(fields)) + table + struct.pack("<I", 0) + more + pixels


width, height, level = map(int, sys.argv[2:5])
rng = random.Random(level)
if sys.argv[1].endswith(".tif"):
    with open(sys.argv[1], "wb") as f:
        f.write(tiff(block(*map(float, sys.argv[5:9]))))
    sys.exit()
rows = b"".join(b"\0" + bytes(level + rng.randrange(-3, 4) for _ in range(width)) for _ in range(height))
exif = b""
if len(sys.argv) > 5:
    data = broken(int(sys.argv[6])) if sys.argv[5] == "broken" else block(*map(float, sys.argv[5:9]))
    exif = chunk(b"eXIf", data)
with open(sys.argv[1], "wb") as f:
    f.write(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 0, 0, 0, 0)) + exif
            + chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b""))
