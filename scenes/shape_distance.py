#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""How far is a mesh from another one? (docs/do/shape.md)

    scenes/shape_distance.py MESH.obj TRUTH.obj [FOUND.txt]

Prints the mean distance between the surfaces, of both directions (half the symmetric Chamfer distance),
and the largest (Hausdorff), over 500 points of each, in the unit of the files. FOUND: a file with a line
NAME.vertex_positions=NUMBERS, such as the textures.txt of `importon fit -o`; MESH then has these vertices."""
import math
import random
import sys


def minus(a, b):
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


def dot(a, b):
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(a, b):
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def read_obj(path):
    """Vertices and triangles, in the order in which faces first name the vertices, as importon has them."""
    place, order, triangles = [], {}, []
    for line in open(path, encoding="ascii"):
        word = line.split()
        if word and word[0] == "v":
            place.append(tuple(float(x) for x in word[1:4]))
        elif word and word[0] == "f":
            triangles.append([order.setdefault(int(w.split("/")[0]) - 1, len(order)) for w in word[1:4]])
    return [place[k] for k in order], triangles


def read_found(path, n):
    for line in open(path, encoding="ascii"):
        name, _, numbers = line.partition("=")
        if name.endswith(".vertex_positions"):
            x = [float(v) for v in numbers.split(",")]
            if len(x) == 3 * n:
                return list(zip(x[0::3], x[1::3], x[2::3]))
    sys.exit("%s: no vertex_positions of %d vertices" % (path, n))


def to_side(p, d):
    """Squared distance of p from the line from the origin to d."""
    s = min(max(dot(p, d) / dot(d, d), 0), 1)
    r = p[0] - s * d[0], p[1] - s * d[1], p[2] - s * d[2]
    return dot(r, r)


def to_triangle(p, a, b, c):
    """Squared distance: from the plane above the triangle, else from its sides."""
    u, v, q = minus(b, a), minus(c, a), minus(p, a)
    n = cross(u, v)
    nn = dot(n, n)
    y, z = dot(cross(q, v), n) / nn, dot(cross(u, q), n) / nn
    if y >= 0 and z >= 0 and y + z <= 1:
        return dot(q, n) ** 2 / nn
    return min(to_side(q, u), to_side(q, v), to_side(minus(p, b), minus(c, b)))


class Surface:
    """Triangles, by the cells of a grid that their boxes reach."""

    def __init__(self, vertices, triangles):
        self.corners = [tuple(vertices[i] for i in t) for t in triangles]
        sides = [math.dist(c[0], c[1]) for c in self.corners]
        self.size = 2 * sum(sides) / len(sides)
        self.cells = {}
        for k, c in enumerate(self.corners):
            lo, hi = self.cell([min(x) for x in zip(*c)]), self.cell([max(x) for x in zip(*c)])
            for at in ((x, y, z) for x in range(lo[0], hi[0] + 1) for y in range(lo[1], hi[1] + 1)
                       for z in range(lo[2], hi[2] + 1)):
                self.cells.setdefault(at, []).append(k)

    def cell(self, p):
        return tuple(math.floor(x / self.size) for x in p)

    def distance(self, p):
        """Shells of cells around p's, until what is farther cannot be nearer."""
        here, best, seen = self.cell(p), math.inf, set()
        for r in range(1000):
            if best <= ((r - 1) * self.size) ** 2:
                break
            for x in range(-r, r + 1):
                for y in range(-r, r + 1):
                    for z in range(-r, r + 1) if r in (abs(x), abs(y)) else (-r, r) if r else (0,):
                        for k in self.cells.get((here[0] + x, here[1] + y, here[2] + z), ()):
                            if k not in seen:
                                seen.add(k)
                                best = min(best, to_triangle(p, *self.corners[k]))
        return math.sqrt(best)

    def points(self, n, chance):
        """n points, evenly over the area."""
        area = [math.hypot(*cross(minus(b, a), minus(c, a))) for a, b, c in self.corners]
        for a, b, c in chance.choices(self.corners, area, k=n):
            s, t = chance.random(), chance.random()
            if s + t > 1:
                s, t = 1 - s, 1 - t
            yield tuple(x + s * (y - x) + t * (z - x) for x, y, z in zip(a, b, c))


def main():
    if len(sys.argv) not in (3, 4):
        sys.exit(__doc__)
    (v, t), (w, s) = read_obj(sys.argv[1]), read_obj(sys.argv[2])
    if len(sys.argv) == 4:
        v = read_found(sys.argv[3], len(v))
    one, other, chance = Surface(v, t), Surface(w, s), random.Random(1)
    d = [[b.distance(p) for p in a.points(500, chance)] for a, b in ((one, other), (other, one))]
    print("mean distance %.3f, largest %.2f; the truth is %.2f from corner to corner" % (
        sum(map(sum, d)) / 1000, max(map(max, d)), math.dist([min(x) for x in zip(*w)], [max(x) for x in zip(*w)])))


if __name__ == "__main__":
    main()
