#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Write a scene in which the shape of an object is looked for (docs/do/shape.md).

    scenes/make_shape.py FOLDER [--views 16] [--frequency 22] [--res 64]

FOLDER/shape.xml has a ball, start.obj, over a floor under two lamps, and that many cameras around it;
FOLDER/truth.xml has truth.obj in its place, a knotty body of finer triangles that the ball has to become.
A sphere of frequency f has 10 f^2 + 2 vertices: the faces of an icosahedron, each cut into f^2 triangles."""
import argparse
import math
import os


def icosahedron():
    g = (1 + math.sqrt(5)) / 2
    v = [(s * a, t * b, 0.) for a, b in ((1, g),) for s in (-1, 1) for t in (-1, 1)]
    v = [p[k:] + p[:k] for k in range(3) for p in v]
    side = 4 + 1e-6
    near = [[sum((x - y) ** 2 for x, y in zip(p, q)) < side for q in v] for p in v]
    faces = []
    for a in range(12):
        for b in range(a + 1, 12):
            for c in range(b + 1, 12):
                if near[a][b] and near[b][c] and near[a][c]:
                    (ax, ay, az), (bx, by, bz), (cx, cy, cz) = v[a], v[b], v[c]
                    out = (ax * (by * cz - bz * cy) + ay * (bz * cx - bx * cz) + az * (bx * cy - by * cx)) > 0
                    faces.append((a, b, c) if out else (a, c, b))
    return v, faces


def sphere(frequency):
    """Unit directions, and triangles of their indices."""
    corner, faces = icosahedron()
    index, points, triangles = {}, [], []

    def vertex(face, i, j):
        weight = {}
        for at, w in zip(face, (frequency - i - j, i, j)):
            if w:
                weight[at] = w
        key = tuple(sorted(weight.items()))
        if key not in index:
            p = [sum(w * corner[at][k] for at, w in key) for k in range(3)]
            length = math.sqrt(sum(x * x for x in p))
            index[key] = len(points)
            points.append(tuple(x / length for x in p))
        return index[key]

    for face in faces:
        for i in range(frequency):
            for j in range(frequency - i):
                a, b, c = vertex(face, i, j), vertex(face, i + 1, j), vertex(face, i, j + 1)
                triangles.append((a, b, c))
                if i + j < frequency - 1:
                    triangles.append((b, vertex(face, i + 1, j + 1), c))
    return points, triangles


KNOBS = (((.8, .5, .33), .42), ((-.75, .45, .5), .38), ((.1, -.95, .3), .4), ((-.2, .1, 1), .35), ((.3, .6, -.75), .3))


def body(d):
    """A point of the truth in direction d of the ball: knobs on a body that is twisted and tapered."""
    r = .78
    for n, height in KNOBS:
        size = math.sqrt(sum(x * x for x in n))
        r += height * math.exp(9 * (sum(a * b for a, b in zip(d, n)) / size - 1))
    x, y, z = (r * c for c in d)
    x, y = x * (1 - .2 * z), y * (1 - .2 * z)
    turn = .5 * z
    return (x * math.cos(turn) - y * math.sin(turn), x * math.sin(turn) + y * math.cos(turn), 1.1 * z)


def normals(points, triangles):
    total = [[0., 0., 0.] for _ in points]
    for t in triangles:
        a, b, c = (points[i] for i in t)
        u, v = [q - p for p, q in zip(a, b)], [q - p for p, q in zip(a, c)]
        n = (u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0])
        for i in t:
            for k in range(3):
                total[i][k] += n[k]
    return [tuple(x / math.sqrt(sum(y * y for y in n)) for x in n) for n in total]


def write_obj(path, points, triangles):
    """With vertex normals, so that it is shaded smoothly."""
    with open(path, "w", encoding="ascii") as f:
        for p in points:
            f.write("v %.7g %.7g %.7g\n" % p)
        for n in normals(points, triangles):
            f.write("vn %.6g %.6g %.6g\n" % n)
        for t in triangles:
            f.write("f %d//%d %d//%d %d//%d\n" % tuple(i + 1 for i in t for _ in range(2)))


SCENE = """<scene version="3.0.0">
    <default name="res" value="%(res)d"/>
    <default name="spp" value="16"/>
    <integrator type="path"> <integer name="max_depth" value="2"/> </integrator>
%(cameras)s    <shape type="rectangle" id="floor">
        <transform name="to_world"> <scale value="4"/> <translate z="-1.6"/> </transform>
        <bsdf type="diffuse"> <rgb name="reflectance" value="0.5, 0.5, 0.5"/> </bsdf>
    </shape>
    <shape type="obj" id="body">
        <string name="filename" value="%(mesh)s.obj"/>
        <bsdf type="diffuse" id="clay"> <rgb name="reflectance" value="0.7, 0.6, 0.5"/> </bsdf>
    </shape>
    <shape type="rectangle" id="lamp">
        <transform name="to_world"> <scale value="1.4"/> <lookat origin="3.2, -2.4, 6.4" target="0, 0, 0" up="0, 1, 0"/> </transform>
        <emitter type="area"> <rgb name="radiance" value="10, 9.3, 8.6"/> </emitter>
    </shape>
    <emitter type="constant" id="sky"> <rgb name="radiance" value="0.35, 0.4, 0.5"/> </emitter>
</scene>
"""

CAMERA = """    <sensor type="perspective" id="camera%(k)d">
        <float name="fov" value="36"/>
        <transform name="to_world"> <lookat origin="%(x).4f, %(y).4f, %(z).4f" target="0, 0, -0.1" up="0, 0, 1"/> </transform>
        <film type="hdrfilm">
            <integer name="width" value="$res"/> <integer name="height" value="$res"/> <rfilter type="box"/>
        </film>
        <sampler type="independent"> <integer name="sample_count" value="$spp"/> </sampler>
    </sensor>
"""


def cameras(n, distance=5.):
    """Around the object, between the floor and the zenith."""
    text = ""
    for k in range(n):
        turn, z = 2.39996 * k, -.22 + 1.1 * (k + .5) / n
        across = math.sqrt(1 - z * z)
        text += CAMERA % {"k": k, "x": distance * across * math.cos(turn), "y": distance * across * math.sin(turn),
                          "z": distance * z}
    return text


def main():
    p = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    p.add_argument("folder")
    for name, value in (("views", 16), ("frequency", 22), ("res", 64)):
        p.add_argument("--" + name, type=int, default=value)
    a = p.parse_args()
    os.makedirs(a.folder, exist_ok=True)
    points, triangles = sphere(a.frequency)
    write_obj(os.path.join(a.folder, "start.obj"), points, triangles)
    fine, fine_triangles = sphere(2 * a.frequency)
    write_obj(os.path.join(a.folder, "truth.obj"), [body(d) for d in fine], fine_triangles)
    for scene, mesh in (("shape", "start"), ("truth", "truth")):
        with open(os.path.join(a.folder, scene + ".xml"), "w", encoding="ascii") as f:
            f.write(SCENE % {"res": a.res, "cameras": cameras(a.views), "mesh": mesh})
    print("%d views, a ball of %d vertices" % (a.views, len(points)))


if __name__ == "__main__":
    main()
