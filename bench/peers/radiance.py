# SPDX-License-Identifier: Apache-2.0
"""Illuminances of a grid beside Radiance's rtrace: agreement, and processor time to 2 % at the points.

    python3 bench/peers/radiance.py [-b IMPORTON] [-r FOLDER] [--polygons N ...] [--rooms N] [--seed S]

FOLDER has oconv and rtrace (`pip install pyradiance` brings them, in pyradiance/bin); without them the script
skips with 77. Rooms are made by a generator with a seed: 10 m x 8 m x 3 m, reflectance .5, four luminous
squares below the ceiling, and boxes of any rotation below .7 m, N polygons in all. The grid has 10 x 10 points
at .75 m. Light is direct and reflected up to five times in both (max_depth 6, -ab 5). The reference is a long run of `importon read`.
For each program the samples (read: --spp; rtrace: -ad, interpolated with -aa .15 -ar 128) are doubled until the
largest relative error of the 100 points (with --rms: the root of their mean square), a geometric mean over the rooms,
is below 2 %; samples and processor seconds, start included, are those for 2 %, on the line through the last two
numbers of samples in logarithms. The error of one room is a matter of luck: it falls below 2 % at half of the samples,
or at twice as many. read makes its tree from the polygons, rtrace has its own from oconv: ratios are told without and
with its seconds. rtrace has -ds .02, since with larger parts of the lamps its error does not fall below 3 %.
"""
import argparse
import json
import math
import os
import random
import resource
import shutil
import subprocess
import sys
import tempfile

here = os.path.dirname(os.path.abspath(__file__))
root = os.path.dirname(os.path.dirname(here))
SIZE, HIGH, LAMP, RADIANCE = (10., 8., 3.), 2.95, .6, 40.
LAMPS = [(x, y) for x in (2.5, 7.5) for y in (2., 6.)]


def boxes(n, seed):
    """Quadrilaterals of n // 6 boxes, corners counterclockwise from outside."""
    r, found = random.Random(seed), []
    for _ in range(n // 6):
        half = [r.uniform(.02, .25) / (1 + n / 20000) for _ in range(2)]
        z0, angle = r.uniform(0, .3), r.uniform(0, math.pi)
        z1 = z0 + r.uniform(.05, .35)
        x, y = r.uniform(.4, SIZE[0] - .4), r.uniform(.4, SIZE[1] - .4)
        c, s = math.cos(angle), math.sin(angle)
        plan = [(x + c * u - s * v, y + s * u + c * v) for u, v in
                ((-half[0], -half[1]), (half[0], -half[1]), (half[0], half[1]), (-half[0], half[1]))]
        low, top = [(*p, z0) for p in plan], [(*p, z1) for p in plan]
        found += [top, low[::-1]] + [[low[k], low[(k + 1) % 4], top[(k + 1) % 4], top[k]] for k in range(4)]
    return found


def walls():
    """The room's six faces, corners counterclockwise from inside."""
    x, y, z = SIZE
    return [[(0, 0, 0), (x, 0, 0), (x, y, 0), (0, y, 0)], [(0, 0, z), (0, y, z), (x, y, z), (x, 0, z)],
            [(0, 0, 0), (0, 0, z), (x, 0, z), (x, 0, 0)], [(0, y, 0), (x, y, 0), (x, y, z), (0, y, z)],
            [(0, 0, 0), (0, y, 0), (0, y, z), (0, 0, z)], [(x, 0, 0), (x, 0, z), (x, y, z), (x, y, 0)]]


def lamp(x, y):
    h = LAMP / 2  # looks down
    return [(x - h, y - h, HIGH), (x - h, y + h, HIGH), (x + h, y + h, HIGH), (x + h, y - h, HIGH)]


def points():
    """In the order of read's rows."""
    return [(SIZE[0] * (i + .5) / 10, SIZE[1] * (j + .5) / 10, .75) for j in range(10) for i in range(10)]


def polygon(material, name, corners):
    return "%s polygon %s\n0 0 %d\n%s\n" % (material, name, 3 * len(corners),
                                            "\n".join("%.9g %.9g %.9g" % p for p in corners))


def radiance_scene(path, faces):
    with open(path, "w", encoding="utf-8") as f:
        f.write("void plastic grey 0 0 5 .5 .5 .5 0 0\nvoid light glow 0 0 3 %g %g %g\n" % ((RADIANCE,) * 3))
        for k, face in enumerate(faces):
            f.write(polygon("grey", "p%d" % k, face))
        for k, at in enumerate(LAMPS):
            f.write(polygon("glow", "lamp%d" % k, lamp(*at)))


def importon_scene(folder, faces):
    with open(os.path.join(folder, "room.obj"), "w", encoding="utf-8") as f:
        for face in faces:
            f.write("".join("v %.9g %.9g %.9g\n" % p for p in face))
        for k in range(len(faces)):
            f.write("f %d %d %d %d\n" % tuple(4 * k + c for c in (1, 2, 3, 4)))
    grey = '<bsdf type="diffuse"><rgb name="reflectance" value=".5"/></bsdf>'
    text = ['<scene version="3.0.0"><integrator type="path"><integer name="max_depth" value="6"/></integrator>',
            '<shape type="obj"><string name="filename" value="room.obj"/><boolean name="face_normals" value="true"/>'
            '<bsdf type="twosided">%s</bsdf></shape>' % grey]
    for x, y in LAMPS:
        text.append('<shape type="rectangle"><transform name="to_world"><scale value="%g"/><rotate x="1" angle="180"/>'
                    '<translate x="%g" y="%g" z="%g"/></transform><bsdf type="diffuse"><rgb name="reflectance" value="0"/>'
                    '</bsdf><emitter type="area"><rgb name="radiance" value="%g"/></emitter></shape>'
                    % (LAMP / 2, x, y, HIGH, RADIANCE))
    text.append('<shape type="rectangle"><transform name="to_world"><scale x="%g" y="%g"/><translate x="%g" y="%g" z=".75"/>'
                '</transform><sensor type="irradiancemeter" id="grid"><boolean name="virtual" value="true"/>'
                '<string name="at" value="points"/><film type="hdrfilm"><integer name="width" value="10"/>'
                '<integer name="height" value="10"/></film></sensor></shape></scene>'
                % (SIZE[0] / 2, SIZE[1] / 2, SIZE[0] / 2, SIZE[1] / 2))
    path = os.path.join(folder, "room.xml")
    with open(path, "w", encoding="utf-8") as f:
        f.write("\n".join(text))
    return path


def processor_seconds():
    """Of all programs that have ended."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def timed(command, text=None):
    """Output and processor seconds of a program."""
    before = processor_seconds()
    ran = subprocess.run(command, input=text, capture_output=True, text=True, check=True)
    return ran.stdout, processor_seconds() - before


def read(importon, scene, spp, seed):
    out, seconds = timed([importon, "read", scene, "-m", "mono", "--grid", "--json", "-t", "1", "--spp", str(spp),
                          "--seed", str(seed)])
    g = json.loads(out)["grids"][0]
    at = sorted(range(100), key=lambda i: (round(g["points"][i][1], 6), round(g["points"][i][0], 6)))
    return [g["value"][i] for i in at], seconds


def rtrace(folder, octree, ad, interpolated):
    rays = "".join("%g %g %g 0 0 1\n" % p for p in points())
    more = ["-aa", ".15", "-ar", "128", "-as", str(ad // 4)] if interpolated else ["-aa", "0", "-as", "0"]
    out, seconds = timed([os.path.join(folder, "rtrace"), "-I", "-h", "-w", "-ab", "5", "-ad", str(ad), "-lw", "0",
                          "-lr", "8", "-ds", ".02", "-dj", ".7", *more, octree], rays)
    return [float(line.split()[1]) for line in out.splitlines() if len(line.split()) >= 3], seconds


def rms(values, truth):
    return math.sqrt(sum((v / t - 1) ** 2 for v, t in zip(values, truth)) / len(truth))


def worst(values, truth):
    return max(abs(v / t - 1) for v, t in zip(values, truth))


def mean_log(numbers):
    return sum(math.log(x) for x in numbers) / len(numbers)


def until(run, first, most, rooms, error_of):
    """Samples, doubled until the rooms' error is below 2 %: samples, error, ratio of the means, seconds, at 2 % where
    two numbers of samples are around it. run(room, samples): values and seconds."""
    n, before = first, None
    while True:
        runs = [(room, *run(room, n)) for room in rooms]
        error = mean_log([error_of(values, room.truth) for room, values, _ in runs])
        seconds = mean_log([s for _, _, s in runs])
        ratio = sum(sum(v / t for v, t in zip(values, room.truth)) / len(room.truth) for room, values, _ in runs) / len(rooms)
        if error < math.log(.02) and before:
            part = (before[1] - math.log(.02)) / (before[1] - error)
            at = [a + part * (b - a) for a, b in zip(before, (math.log(n), math.log(.02), seconds))]
            return math.exp(at[0]), .02, ratio, math.exp(at[2])
        if error < math.log(.02) or n >= most or math.exp(seconds) > 200:
            return n, math.exp(error), ratio, math.exp(seconds)
        n, before = 2 * n, (math.log(n), error, seconds)


class Room:
    """A room in both formats, in a folder, with the reference."""

    def __init__(self, folder, polygons, seed, a):
        os.mkdir(folder)
        faces = walls() + boxes(polygons - 10, seed)
        self.polygons = len(faces) + len(LAMPS)
        self.scene = importon_scene(folder, faces)
        rad, self.octree = os.path.join(folder, "room.rad"), os.path.join(folder, "room.oct")
        radiance_scene(rad, faces)
        before = processor_seconds()
        with open(self.octree, "wb") as f:
            subprocess.run([os.path.join(a.radiance, "oconv"), rad], stdout=f, check=True)
        self.oconv = processor_seconds() - before
        self.truth = read(a.importon, self.scene, 32768, 12345)[0]


def main():
    ap = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    ap.add_argument("-b", "--importon", default=os.path.join(root, "build/cli/importon"))
    ap.add_argument("-r", "--radiance", default=os.path.dirname(shutil.which("rtrace") or ""))
    ap.add_argument("--polygons", type=int, nargs="+", default=[1000, 10000, 100000])
    ap.add_argument("--rooms", type=int, default=5, help="as many rooms of each size, by so many seeds")
    ap.add_argument("--seed", type=int, default=1)
    ap.add_argument("--rms", action="store_true", help="2 %% of all points together, in place of each")
    ap.add_argument("--plain", action="store_true", help="without interpolated irradiances, which take minutes")
    a = ap.parse_args()
    if not os.access(os.path.join(a.radiance, "rtrace"), os.X_OK):
        print("SKIP: no rtrace in '%s' (pip install pyradiance)" % a.radiance, file=sys.stderr)
        sys.exit(77)
    os.environ.setdefault("RAYPATH", os.path.join(os.path.dirname(a.radiance), "lib"))
    for n in a.polygons:
        with tempfile.TemporaryDirectory() as folder:
            rooms = [Room(os.path.join(folder, str(k)), n, a.seed + k, a) for k in range(a.rooms)]
            error_of = rms if a.rms else worst
            start = min(read(a.importon, room.scene, 2, 0)[1] for room in rooms)
            rows = [("read", until(lambda room, spp: read(a.importon, room.scene, spp, 1), 16, 1 << 16, rooms, error_of)),
                    ("rtrace", until(lambda room, ad: rtrace(a.radiance, room.octree, ad, False), 16, 1 << 14, rooms, error_of))]
            if not a.plain:
                rows.append(("rtrace, interpolated",
                             until(lambda room, ad: rtrace(a.radiance, room.octree, ad, True), 8, 1 << 13, rooms, error_of)))
            oconv = math.exp(mean_log([room.oconv for room in rooms]))
            print("%d polygons, %d rooms, start of read %.2f s, oconv %.2f s"
                  % (rooms[0].polygons, len(rooms), start, oconv))
            for name, (samples, error, mean, seconds) in rows:
                line = ("    %-22s samples %-6.0f error %.4f  mean ratio %.4f  %.3f s  %.1f times read's"
                        % (name, samples, error, mean, seconds, seconds / rows[0][1][3]))
                print(line + (", %.1f with oconv" % ((seconds + oconv) / rows[0][1][3]) if name != "read" else ""))
            sys.stdout.flush()


if __name__ == "__main__":
    main()
