# SPDX-License-Identifier: Apache-2.0
"""Imitates a camera: camera.py PICTURE.pfm PHOTO.ppm GAMMA NOISE SEED [X,Y,W,H]. Reads linear values,
writes 8 bits with gamma and noise, white at 1, and a foreign block if its place is given."""
import array
import random
import sys

source, photo, gamma, noise = *sys.argv[1:3], *map(float, sys.argv[3:5])
kind, size, _, data = open(source, "rb").read().split(b"\n", 3)
width, height = map(int, size.split())
channels = 3 if kind == b"PF" else 1
v = array.array("f", data[:4 * width * height * channels])
rows = [v[y * width * channels:(y + 1) * width * channels] for y in range(height)][::-1]
rng = random.Random(int(sys.argv[5]))
out = [[min(255, max(0, round(255 * (max(x, 0) ** (1 / gamma) + noise * rng.gauss(0, 1))))) for x in row] for row in rows]
if len(sys.argv) > 6:
    x0, y0, w, h = map(int, sys.argv[6].split(","))
    for y in range(y0, y0 + h):
        for k in range(x0 * channels, (x0 + w) * channels):
            out[y][k] = rng.randrange(256)
with open(photo, "wb") as f:
    f.write(b"P%d %d %d 255\n" % (6 if channels == 3 else 5, width, height) + bytes(b for row in out for b in row))
