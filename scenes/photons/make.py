#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Writes paraboloid.ply and sky.pfm, which the scenes of this folder use, and chart.xml beside itself."""
import math
import os
import re
import struct

here = os.path.dirname(os.path.abspath(__file__))

# z = r^2/4f with f = 0.05, out to r = 0.1; normals towards the axis.
F, R, RINGS, SIDES = 0.05, 0.1, 12, 48
vertices, faces = [], []
for i in range(RINGS + 1):
    for j in range(SIDES if i else 1):
        a, r = 2 * math.pi * j / SIDES, R * i / RINGS
        x, y = r * math.cos(a), r * math.sin(a)
        n = math.sqrt(r * r + 4 * F * F)
        vertices.append((x, y, r * r / (4 * F), -x / n, -y / n, 2 * F / n))
for i in range(RINGS):
    for j in range(SIDES):
        k, out, inner = (j + 1) % SIDES, 1 + i * SIDES, 1 + (i - 1) * SIDES
        faces.append((inner + j if i else 0, out + j, out + k))
        if i:
            faces.append((inner + j, out + k, inner + k))
with open(os.path.join(here, "paraboloid.ply"), "wb") as f:
    f.write(b"ply\nformat binary_little_endian 1.0\nelement vertex %d\n" % len(vertices))
    f.write(b"".join(b"property float %s\n" % p for p in (b"x", b"y", b"z", b"nx", b"ny", b"nz")))
    f.write(b"element face %d\nproperty list uchar uint vertex_indices\nend_header\n" % len(faces))
    f.write(b"".join(struct.pack("<6f", *v) for v in vertices))
    f.write(b"".join(struct.pack("<B3I", 3, *t) for t in faces))

# A blue sky, a dull ground, and a sun of some texels 500 times as bright.
W, H = 64, 32
with open(os.path.join(here, "sky.pfm"), "wb") as f:
    f.write(b"PF\n%d %d\n-1.0\n" % (W, H))
    for j in reversed(range(H)):  # from the bottom row
        up = math.cos(math.pi * (j + 0.5) / H)
        for i in range(W):
            c = (0.35 - 0.2 * up, 0.45 - 0.1 * up, 0.7) if up > 0 else (0.12, 0.1, 0.08)
            if 19 <= i <= 20 and 7 <= j <= 8:
                c = (220, 200, 160)
            f.write(struct.pack("<3f", *c))

# A colour chart in daylight, from the reflectances that the tests have.
chart = open(os.path.join(here, "..", "..", "tests", "macbeth.h")).read()
patches = re.findall(r'\{"([^"]+)", \{([^}]*)\}\}', chart)
assert len(patches) == 24
with open(os.path.join(here, "chart.xml"), "w") as f:
    f.write('''<?xml version="1.0" encoding="utf-8"?>
<!-- SPDX-License-Identifier: Apache-2.0

     A Macbeth chart in daylight, without absorption: what is noise is the wavelengths' (Morley et al. 2006, Fig. 11).
     Reflectances: average of 30 charts, (c) Danny Pascale (BabelColor), used by permission in colour-science. Written
     by make.py.

     importon render scenes/photons/chart.xml -m single -o chart.exr -->
<scene version="3.0.0">
    <default name="spp" value="49"/>
    <default name="width" value="144"/>
    <default name="height" value="96"/>
    <integrator type="photons">
        <integer name="max_depth" value="2"/>
        <float name="h" value="1000"/>
    </integrator>
    <sensor type="orthographic">
        <transform name="to_world">
            <scale x="3" y="3" z="1"/>
            <lookat origin="0, 0, 1" target="0, 0, 0" up="0, 1, 0"/>
        </transform>
        <sampler type="independent"><integer name="sample_count" value="$spp"/></sampler>
        <film type="hdrfilm">
            <integer name="width" value="$width"/>
            <integer name="height" value="$height"/>
            <rfilter type="box"/>
        </film>
    </sensor>
    <emitter type="constant"/>
''')
    for k, (name, values) in enumerate(patches):
        rho = [float(v) for v in values.replace("\n", " ").split(",") if v.strip()]
        pairs = ", ".join("%d:%g" % (380 + 10 * i, v) for i, v in enumerate(rho))
        f.write('''    <shape type="rectangle" id="%s">
        <transform name="to_world"><scale value="0.44"/><translate x="%g" y="%g"/></transform>
        <bsdf type="diffuse"><spectrum name="reflectance" value="%s, 830:%g"/></bsdf>
    </shape>
''' % (name.replace(" ", "_").replace(",", "").replace(".", "_").replace("(", "").replace(")", ""), k % 6 - 2.5, 1.5 - k // 6, pairs, rho[-1]))
    f.write("</scene>\n")
