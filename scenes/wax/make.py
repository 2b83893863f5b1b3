#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
#
#     scenes/wax/make.py wax.ply
#
# A closed mesh for scenes/wax.xml: a ball whose radius is 1 plus waves, in 96 by 192 cells of angle.
import math
import struct
import sys

ROWS, COLUMNS = 96, 192


def point(i, j):
    t, p = math.pi * i / ROWS, 2 * math.pi * j / COLUMNS
    d = (math.sin(t) * math.cos(p), math.cos(t), math.sin(t) * math.sin(p))
    r = 1 + 0.12 * math.sin(5 * p) * math.sin(t) ** 3 + 0.08 * math.cos(6 * t)
    return [r * x for x in d]


vertices = [point(0, 0)] + [point(i, j) for i in range(1, ROWS) for j in range(COLUMNS)] + [point(ROWS, 0)]
at = lambda i, j: 0 if i == 0 else len(vertices) - 1 if i == ROWS else 1 + (i - 1) * COLUMNS + j % COLUMNS
faces = []
for i in range(ROWS):
    for j in range(COLUMNS):
        a, b, c, d = at(i, j), at(i, j + 1), at(i + 1, j), at(i + 1, j + 1)
        if i > 0:
            faces.append((a, b, c))
        if i < ROWS - 1:
            faces.append((b, d, c))
with open(sys.argv[1], 'wb') as f:
    f.write(('ply\nformat binary_little_endian 1.0\nelement vertex %d\nproperty float x\nproperty float y\nproperty float z\n'
             'element face %d\nproperty list uchar int vertex_indices\nend_header\n' % (len(vertices), len(faces))).encode())
    for v in vertices:
        f.write(struct.pack('<3f', *v))
    for t in faces:
        f.write(struct.pack('<B3i', 3, *t))
