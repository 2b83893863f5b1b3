# SPDX-License-Identifier: Apache-2.0
"""A bent bsplinecurve with a bumpmap, and its tube as a mesh: each rendered by both.

    python3 bench/peers/bent_tube.py [-i IMPORTON] [--spp N]

The mesh has the curve's uv, and the tube's normals at its vertices. The tube's ends are below the
floor, because rays leave curves from their inside. One line for each pair of pictures, as of
zcompare.py; the largest of three channels.
"""
import argparse
import os
import tempfile

from zcompare import Case, compare, importon_render, mi, mitsuba_render, np, root

POINTS = np.array([[-2, .5, -2.6, .4], [-2, -.6, -.6, .4], [-1.6, -.9, 1.6, .5],
                   [-.5, .5, 1.6, .4], [.6, -1, 1.4, .5], [1.8, .4, 1.6, .4],
                   [2.1, -.6, -.6, .4], [2.1, -.6, -2.6, .4]])
SEGMENTS, AROUND, ALONG = 5, 160, 120
# Uniform cubic B-spline: coefficients of 1, v, v^2, v^3 in the rows.
BASIS = np.array([[1, 4, 1, 0], [-3, 0, 3, 0], [3, -6, 3, 0], [-1, 3, -3, 1]]) / 6


def ring(x):
    """Points and normals around the line at x, in segments."""
    s = min(int(x), SEGMENTS - 1)
    v = x - s
    powers = np.array([[1, v, v * v, v ** 3], [0, 1, 2 * v, 3 * v * v], [0, 0, 2, 6 * v]])
    c, d, e = powers @ BASIS @ POINTS[s:s + 4]
    axis = d[:3] / np.linalg.norm(d[:3])
    z = np.array([0, 0, 1]) - axis * axis[2]
    z /= np.linalg.norm(z)
    turn = 2 * np.pi * np.arange(AROUND + 1)[:, None] / AROUND
    out = np.cross(z, axis) * np.cos(turn) + z * np.sin(turn)
    n = out * (d[:3] @ d[:3] - c[3] * (out @ e[:3]))[:, None] - d[:3] * d[3]
    return c[:3] + out * c[3], n / np.linalg.norm(n, axis=1)[:, None]


def mesh_write(path):
    rows = SEGMENTS * ALONG
    rings = [ring(j / ALONG) for j in range(rows + 1)]
    positions, normals = (np.concatenate([r[k] for r in rings]) for k in range(2))
    v, u = np.mgrid[0:rows + 1, 0:AROUND + 1]
    uv = np.stack([u.ravel() / AROUND, v.ravel() / rows], 1)
    a = (np.arange(rows)[:, None] * (AROUND + 1) + np.arange(AROUND)).ravel()
    b, c, d = a + 1, a + AROUND + 1, a + AROUND + 2
    faces = np.concatenate([np.stack(f, 1) for f in ((a, b, d), (a, d, c))])
    mi.set_variant("llvm_ad_rgb")
    mesh = mi.Mesh("tube", len(positions), len(faces), has_vertex_normals=True,
                   has_vertex_texcoords=True)
    of = mi.traverse(mesh)
    for name, x, kind in (("vertex_positions", positions, np.float32), ("faces", faces, np.uint32),
                          ("vertex_normals", normals, np.float32), ("vertex_texcoords", uv, np.float32)):
        of[name] = x.ravel().astype(kind)
    of.update()
    mesh.write_ply(path)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("-i", "--importon", default=os.path.join(root, "build/cli/importon"))
    parser.add_argument("--spp", type=int, default=512)
    args = parser.parse_args()
    peer = os.path.join(root, "tests/render/peer")
    with open(os.path.join(peer, "bumps_curves.xml")) as file:
        text = file.read().replace("stage.xml", os.path.join(peer, "stage.xml"))
    text = text.replace("files/grey.png", os.path.join(peer, "files/grey.png"))
    with tempfile.TemporaryDirectory() as folder:
        tube, ply = (os.path.join(folder, n) for n in ("tube.txt", "tube.ply"))
        np.savetxt(tube, POINTS, fmt="%g")
        mesh_write(ply)
        scenes = {"curve": text.replace("files/rods.txt", tube),
                  "mesh": text.replace("files/rods.txt", ply).replace("bsplinecurve", "ply")}
        ours, theirs = {}, {}
        for name, scene in scenes.items():
            path = os.path.join(folder, name + ".xml")
            with open(path, "w") as file:
                file.write(scene)
            case = Case(name, [path])
            ours[name] = importon_render(args.importon, case, args.spp, 1,
                                         os.path.join(folder, "x.exr"))
            theirs[name] = mitsuba_render(case, args.spp)[0]
        for a, (mean, se, _) in ours.items():
            for b, batches in theirs.items():
                r = compare(mean, se, batches, False).values()
                print("importon's %-5s  Mitsuba's %-5s  mean z %5.2f  failed %.4f  |z|>2 %.4f" %
                      (a, b, max((c["mean_z"] for c in r), key=abs),
                       max(c["failed"] for c in r), max(c["over2"] for c in r)))


if __name__ == "__main__":
    main()
