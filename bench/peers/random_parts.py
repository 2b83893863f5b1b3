# SPDX-License-Identifier: Apache-2.0
"""Scenes at random: one number makes one scene, with its files, out of every kind that importon and Mitsuba 3.9 both have.

    python3 bench/peers/random_parts.py SEED MODE FOLDER       # writes FOLDER/scene.xml and what it names

Materials, textures and lights stand inside what uses them, without ids, so that parameters have the names of mi.traverse
in both. What docs/mitsuba.md lists as different is left out: mirrored meshes, `mask` under `path`, mirrors in
blends, and in spectral mode metals by name, the tints of `principled`, texels of light above 1, and so on. There colours are lists of
wavelengths, and pictures grey: Mitsuba looks the spectrum of three numbers up in a table, importon solves for it, and
after some reflections in coloured light that makes .5 %.
"""
import math
import os
import random
import re
import struct
import sys
import zlib


def png_write(path, width, height, channels, data):
    """8 bits; data [height][width][channels], 0..255."""
    rows = b"".join(b"\0" + bytes(data[y * width * channels:(y + 1) * width * channels]) for y in range(height))
    def chunk(kind, body):
        return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))
    with open(path, "wb") as f:
        f.write(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 0 if channels == 1 else 2, 0, 0, 0)) +
                chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b""))


def pfm_write(path, width, height, data):
    with open(path, "wb") as f:
        f.write(b"PF\n%d %d\n-1.0\n" % (width, height) + struct.pack("<%df" % len(data), *data))


def vol_write(path, n, channels, data):
    with open(path, "wb") as f:
        f.write(b"VOL\x03" + struct.pack("<iiiii6f", 1, *n, channels, 0, 0, 0, 1, 1, 1) + struct.pack("<%df" % len(data), *data))


def blob(rings, sectors, wobble, random_):
    """A closed surface about the origin: points, their (radial) normals, uv, triangles."""
    points, normals, uvs, triangles = [], [], [], []
    a, b = random_.uniform(2, 4), random_.uniform(0, 6)
    for i in range(rings + 1):
        for j in range(sectors + 1):
            theta, phi = math.pi * i / rings, 2 * math.pi * j / sectors
            d = (math.sin(theta) * math.cos(phi), math.sin(theta) * math.sin(phi), math.cos(theta))
            r = 1 + wobble * math.sin(theta) ** 2 * math.cos(round(a) * phi + b)
            points.append([r * x for x in d])
            normals.append(d)
            uvs.append((j / sectors, i / rings))
    for i in range(rings):
        for j in range(sectors):
            p, q = i * (sectors + 1) + j, (i + 1) * (sectors + 1) + j
            if i > 0:
                triangles.append((p, q, p + 1))
            if i < rings - 1:
                triangles.append((p + 1, q, q + 1))
    return points, normals, uvs, triangles


class Maker:
    def __init__(self, seed, mode, folder):
        self.r, self.mode, self.folder = random.Random("%d" % seed), mode, folder
        self.seed, self.files, self.names = seed, 0, 0
        self.kinds, self.from_lights = [], False
        os.makedirs(folder, exist_ok=True)

    # ---- small things ---------------------------------------------------------------
    def kind(self, name):
        self.kinds.append(name)
        return name

    def file(self, extension):
        self.files += 1
        return "f%d.%s" % (self.files, extension)

    def path(self, name):
        return os.path.join(self.folder, name)

    def maybe(self, p):
        return self.r.random() < p

    def u(self, lo, hi):
        return round(self.r.uniform(lo, hi), 3)

    def rgb_of(self, lo, hi):
        return "%g,%g,%g" % (self.u(lo, hi), self.u(lo, hi), self.u(lo, hi))

    def color(self, name, lo, hi):
        """Three numbers, or in spectral mode a list."""
        if self.mode == "spectral":
            return '<spectrum name="%s" value="%s"/>' % (name, ", ".join("%d:%g" % (nm, self.u(lo, hi)) for nm in (360, 450, 540, 630, 830)))
        return '<rgb name="%s" value="%s"/>' % (name, self.rgb_of(lo, hi))

    def ground(self, name, lo, hi):
        """A color; a list has the wavelengths that Mitsuba evaluates it at."""
        if self.mode != "spectral":
            return self.color(name, lo, hi)
        at, values = (360, 450, 540, 630, 830), [self.u(lo, hi) for _ in range(5)]
        def between(nm):
            k = max(j for j in range(4) if j == 0 or at[j] <= nm)
            return values[k] + max(0, nm - at[k]) / (at[k + 1] - at[k]) * (values[k + 1] - values[k])
        return '<spectrum name="%s" value="%s"/>' % (name, ", ".join("%d:%.4f" % (nm, between(nm)) for nm in range(320, 721, 40)))

    def number(self, name, lo, hi):
        return '<float name="%s" value="%g"/>' % (name, self.u(lo, hi))

    def flag(self, name, p=.5):
        return '<boolean name="%s" value="%s"/>' % (name, "true" if self.maybe(p) else "false")

    def to_uv(self, turned=True):
        return '<transform name="to_uv"><scale x="%g" y="%g"/><rotate z="1" angle="%g"/></transform>' % (
            self.u(.7, 3), self.u(.7, 3), self.u(-40, 40) if turned else 0)

    # ---- textures -------------------------------------------------------------------
    def bitmap(self, name, lo, hi, grey=False, raw=False, linear=False, turned=True):
        self.kind("bitmap")
        same = self.mode == "spectral"  # grey
        w, h = self.r.randint(2, 6), self.r.randint(2, 6)
        if linear:
            file = self.file("pfm")
            texels = [self.r.uniform(lo, hi) for _ in range(w * h * 3)]
            pfm_write(self.path(file), w, h, [texels[k - k % 3] for k in range(w * h * 3)] if same else texels)
        else:
            file, c = self.file("png"), 1 if grey or same else 3
            encode = (lambda x: x) if raw else (lambda x: 1.055 * x ** (1 / 2.4) - .055)
            png_write(self.path(file), w, h, c, [round(255 * encode(self.r.uniform(max(lo, .02), hi))) for _ in range(w * h * c)])
        out = '<texture type="bitmap" name="%s"><string name="filename" value="%s"/>' % (name, file)
        out += '<string name="filter_type" value="%s"/>' % self.r.choice(["bilinear", "nearest"])
        out += '<string name="wrap_mode" value="%s"/>' % self.r.choice(["repeat", "mirror", "clamp"])
        if raw:
            out += '<boolean name="raw" value="true"/>'
        if self.maybe(.4):
            out += self.to_uv(turned)
        return out + "</texture>"

    def checkerboard(self, name, lo, hi, grey):
        self.kind("checkerboard")
        def entry(k):
            return self.number(k, lo, hi) if grey else self.color(k, lo, hi)
        return '<texture type="checkerboard" name="%s">%s%s%s</texture>' % (name, entry("color0"), entry("color1"), self.to_uv())

    def reflectance(self, name, lo=.05, hi=.9, nested=True):
        """Written colour, or a texture. nested: Mitsuba's coats ask for the mean, which only bitmaps know."""
        k = self.r.random()
        if not nested and k > .7:
            return self.bitmap(name, lo, hi, linear=self.maybe(.4))
        if k < .5:
            return self.color(name, lo, hi)
        if k < .6:
            return '<spectrum name="%s" value="%g"/>' % (name, self.u(lo, hi))
        if k < .7:
            return '<spectrum name="%s" value="%s"/>' % (name, ", ".join("%d:%g" % (nm, self.u(lo, hi)) for nm in (400, 480, 560, 640, 720)))
        if k < .85:
            return self.bitmap(name, lo, hi, linear=self.maybe(.4))
        if k < .95:
            return self.checkerboard(name, lo, hi, False)
        return self.volume_texture(name, lo, hi)

    def volume_texture(self, name, lo, hi):
        self.kind("volume texture")
        return '<texture type="volume" name="%s">%s</texture>' % (name, self.grid("volume", lo, hi, 3, "<translate x='-.5' y='-.5'/><scale value='7'/>"))

    def scalar(self, name, lo, hi, texture=.3):
        if self.maybe(texture):
            return self.bitmap(name, lo, hi, grey=True, raw=True) if self.maybe(.6) else self.checkerboard(name, lo, hi, True)
        return self.number(name, lo, hi)

    # ---- materials ------------------------------------------------------------------
    def index(self, both=True):
        out = self.number("int_ior", 1.2, 1.9) if self.maybe(.6) else '<string name="int_ior" value="%s"/>' % self.r.choice(["water", "bk7", "diamond"])
        if both and self.maybe(.3):
            out += self.number("ext_ior", 1.0, 1.1)
        return out

    def roughness(self, anisotropic=True, texture=True):
        out = '<string name="distribution" value="%s"/>' % self.r.choice(["ggx", "beckmann"])
        if self.maybe(.3):
            out += self.flag("sample_visible")
        if anisotropic and self.maybe(.3):
            return out + self.number("alpha_u", .15, .6) + self.number("alpha_v", .15, .6)
        return out + (self.scalar("alpha", .2, .6, .2) if texture else self.number("alpha", .15, .6))

    def metal(self):
        if self.mode != "spectral" and self.maybe(.4):
            return '<string name="material" value="%s"/>' % self.r.choice(["Au", "Cu", "Al", "Ag"])
        return self.color("eta", .2, .95) + self.color("k", .3, .95)

    def tint(self, name, p=.4, nested=True):
        return self.reflectance(name, .3, .95, nested) if self.maybe(p) else ""

    def opaque(self, depth=0, bumps=True, maps=True, deltas=True):
        """A material that lets no light through. bumps, maps: may it have bump and normal maps? deltas: mirrors?"""
        simple = ["diffuse", "diffuse", "conductor", "roughconductor", "plastic", "roughplastic", "principled"]
        nested = (["bumpmap"] if bumps else []) + (["normalmap"] if maps else []) + ["blendbsdf"] if depth < 2 else []
        k = self.r.choice(simple + nested)
        # Mitsuba mixes the weight of a mirror's sample with the density of what it is blended with: rough, in a blend.
        dull = {"conductor": "roughconductor", "plastic": "roughplastic"}.get(k, k) if not deltas else k
        out = '<bsdf type="%s">' % self.kind(dull)
        if dull != k:
            out += '<float name="alpha" value="0.3"/>'
        if k == "diffuse":
            out += self.reflectance("reflectance")
        elif k == "conductor":
            out += self.metal() + self.tint("specular_reflectance")
        elif k == "roughconductor":
            out += self.metal() + self.roughness() + self.tint("specular_reflectance")
        elif k == "plastic":  # of diamond, Mitsuba's fit of the reflectance from inside makes the base 3 % brighter
            out += self.index().replace("diamond", "bk7") + self.reflectance("diffuse_reflectance", nested=False) + self.tint("specular_reflectance", nested=False) + self.flag("nonlinear")
        elif k == "roughplastic":
            out += self.index() + self.reflectance("diffuse_reflectance", nested=False) + self.tint("specular_reflectance", nested=False) + self.flag("nonlinear")
            out += self.roughness(False, False)
        elif k == "principled":
            out += self.principled(False)
        elif k == "bumpmap":
            # Mitsuba's slope under a turned to_uv is that of the turn back: not turned.
            out += self.bitmap("arbitrary", 0, 1, grey=True, raw=True, turned=False).replace('"nearest"', '"bilinear"') + self.number("scale", .02, .2)
            out += self.opaque(depth + 1, False, maps, deltas)  # nor nested in another
        elif k == "normalmap":
            file, w, h = self.file("png"), 4, 4
            data = []
            for _ in range(w * h):
                a, b = self.u(-.3, .3), self.u(-.3, .3)
                data += [round(255 * (.5 + .5 * x)) for x in (a, b, math.sqrt(1 - a * a - b * b))]
            png_write(self.path(file), w, h, 3, data)
            out += '<texture type="bitmap" name="normalmap"><string name="filename" value="%s"/><boolean name="raw" value="true"/></texture>' % file
            out += self.opaque(depth + 1, False, maps, deltas)
        elif k == "blendbsdf":
            out += self.scalar("weight", .1, .9) + self.opaque(depth + 1, bumps, maps, False) + self.opaque(depth + 1, bumps, maps, False)
        return out + "</bsdf>"

    def principled(self, thin, glass=False):
        out = self.reflectance("base_color", .1, .9) + self.number("roughness", .3, .8)
        for name in ["anisotropic", "sheen", "flatness"] + (["spec_tint", "sheen_tint"] if self.mode != "spectral" else []) + ([] if thin else ["metallic", "clearcoat", "clearcoat_gloss"]):
            if self.maybe(.4):
                out += self.number(name, .1, .9)
        if thin:
            out += self.number("diff_trans", .1, 1.8) + self.number("spec_trans", .1, .9) + self.number("eta", 1.2, 1.8)
        else:
            if glass:
                out += self.number("spec_trans", .1, .9)
            out += self.number("specular", .2, .8) if self.maybe(.5) else self.number("eta", 1.2, 1.8)
        return out

    def holes(self, depth=0):
        """A material with holes: volpath alone treats it as expected."""
        k = self.kind(self.r.choice(["mask", "thindielectric", "null", "principledthin"]))
        out = '<bsdf type="%s">' % k
        if k == "mask":
            out += self.scalar("opacity", .2, .8) + self.opaque(1)
        elif k == "thindielectric":
            out += self.index() + self.tint("specular_reflectance") + self.tint("specular_transmittance")
        elif k == "principledthin":
            out += self.principled(True)
        return out + "</bsdf>"

    def clear(self):
        k = self.kind(self.r.choice(["dielectric", "roughdielectric", "principled"]))
        if k == "principled":
            return '<bsdf type="principled">%s</bsdf>' % self.principled(False, True)
        out = '<bsdf type="%s">' % k + self.index() + self.tint("specular_reflectance") + self.tint("specular_transmittance")
        return out + (self.roughness(True, False) if k == "roughdielectric" else "") + "</bsdf>"

    def material(self, closed, holes):
        if self.from_lights:  # importon refuses normals of a material's own there
            return self.opaque(0, False, False)
        k = self.r.random()
        if closed and k < .2:
            return self.clear()
        if holes and k < .4:
            return self.holes()
        if k < .6:
            self.kind("twosided")
            return '<bsdf type="twosided">%s%s</bsdf>' % (self.opaque(), self.opaque() if self.maybe(.4) else "")
        return self.opaque()

    # ---- media ----------------------------------------------------------------------
    def grid(self, name, lo, hi, channels, place):
        self.kind("gridvolume")
        file, n = self.file("vol"), [self.r.randint(2, 4) for _ in range(3)]
        channels = 1 if self.mode == "spectral" else channels
        vol_write(self.path(file), n, channels, [self.r.uniform(lo, hi) for _ in range(n[0] * n[1] * n[2] * channels)])
        out = '<volume type="gridvolume" name="%s"><string name="filename" value="%s"/>' % (name, file)
        out += '<string name="filter_type" value="%s"/>' % self.r.choice(["trilinear", "nearest"])
        return out + '<transform name="to_world">%s</transform></volume>' % place

    def phase(self, depth=0):
        k = self.kind(self.r.choice(["isotropic", "hg", "rayleigh"] + (["blendphase"] if depth == 0 else [])))
        out = '<phase type="%s">' % k
        if k == "hg":
            out += self.number("g", -.5, .7)
        if k == "blendphase":
            out += self.number("weight", .1, .9) + self.phase(1) + self.phase(1)
        return out + "</phase>"

    def medium(self, slot, box=None):
        """box: transformation of the unit cube, for a medium whose extinction varies."""
        uneven = box is not None and self.maybe(.5)
        out = '<medium type="%s" name="%s">' % (self.kind("heterogeneous" if uneven else "homogeneous"), slot)
        if uneven:
            out += self.grid("sigma_t", .1, 1, 1, box)
            out += self.grid("albedo", .3, .9, 3, box) if self.maybe(.4) else self.color("albedo", .3, .95)
        else:
            out += self.color("sigma_t", .3, .9) if self.maybe(.5) else self.number("sigma_t", .3, .9)
            out += self.color("albedo", .3, .95)
        out += self.number("scale", .3, 1.5)
        if self.maybe(.7):
            out += self.phase()
        return out + "</medium>"

    # ---- shapes ---------------------------------------------------------------------
    def ply(self, attribute):
        points, normals, uvs, triangles = blob(6, 9, .2, self.r)
        file = self.file("ply")
        color = attribute == "vertex_color"
        def colors():
            c = self.rgb_of(.1, .9).split(",")
            return " ".join([c[0]] * 3 if self.mode == "spectral" else c)
        with open(self.path(file), "w") as f:
            f.write("ply\nformat ascii 1.0\nelement vertex %d\n" % len(points) +
                    "".join("property float %s\n" % k for k in ("x", "y", "z", "nx", "ny", "nz", "u", "v") + (("r", "g", "b") if color else ())))
            f.write("element face %d\nproperty list uchar int vertex_indices\n" % len(triangles))
            f.write("".join("property float %s\n" % k for k in ("color_r", "color_g", "color_b")) if attribute == "face_color" else "")
            f.write("end_header\n")
            for p, n, t in zip(points, normals, uvs):
                f.write(" ".join("%.7g" % x for x in (*p, *n, *t)) + (" " + colors() if color else "") + "\n")
            for t in triangles:
                f.write("3 %d %d %d%s\n" % (*t, " " + colors() if attribute == "face_color" else ""))
        return file

    def obj(self):
        points, normals, uvs, triangles = blob(6, 9, .2, self.r)
        file = self.file("obj")
        with open(self.path(file), "w") as f:
            f.writelines(["v %.7g %.7g %.7g\n" % tuple(p) for p in points] + ["vt %.7g %.7g\n" % t for t in uvs] +
                         ["vn %.7g %.7g %.7g\n" % n for n in normals])
            f.writelines("f %s\n" % " ".join("%d/%d/%d" % (k + 1, k + 1, k + 1) for k in t) for t in triangles)
        return file

    def serialized(self):
        points, normals, uvs, triangles = blob(6, 9, .2, self.r)
        file, version = self.file("serialized"), self.r.choice([3, 4])
        flat = [x for p in points for x in p] + [x for n in normals for x in n] + [x for t in uvs for x in t]
        body = struct.pack("<I", 0x1 | 0x2 | 0x1000) + (b"blob\0" if version == 4 else b"")
        body += struct.pack("<QQ", len(points), len(triangles)) + struct.pack("<%df" % len(flat), *flat)
        body += struct.pack("<%dI" % (3 * len(triangles)), *[k for t in triangles for k in t])
        mesh = struct.pack("<HH", 0x041C, version) + zlib.compress(body)
        with open(self.path(file), "wb") as f:
            f.write(mesh + struct.pack("<Q" if version == 4 else "<I", 0) + struct.pack("<I", 1))
        return file

    def curve(self):
        file = self.file("txt")
        with open(self.path(file), "w") as f:
            for _ in range(3):
                x, y = self.u(-.8, .8), self.u(-.8, .8)
                for k in range(5):
                    f.write("%g %g %g %g\n" % (x + self.u(-.2, .2), y + self.u(-.2, .2), -1 + .5 * k, self.u(.05, .15)))
                f.write("\n")
        return file

    def place(self, x, y, z, size, stretch=True):
        s = [size * self.u(.8, 1.2) for _ in range(3)] if stretch else [size] * 3
        turn = self.r.choice(["x", "y", "z"])
        return ('<transform name="to_world"><scale x="%g" y="%g" z="%g"/><rotate %s="1" angle="%g"/><translate x="%g" y="%g" z="%g"/></transform>'
                % (*s, turn, self.u(-60, 60), x, y, z))

    def body(self, x, y, size, holes, media, inside=""):
        """A shape that stands on the floor."""
        k = self.r.choice(["sphere", "cube", "cylinder", "disk", "rectangle", "obj", "ply", "serialized", "bsplinecurve", "linearcurve", "instance"])
        self.kind(k)
        closed = k in ("sphere", "cube", "obj", "ply", "serialized")
        self.names += 1
        name = "thing%d" % self.names
        props, material = "", None
        if k == "sphere":
            place = '<point name="center" x="%g" y="%g" z="%g"/><float name="radius" value="%g"/>' % (x, y, size, size)
        elif k in ("bsplinecurve", "linearcurve"):
            props += '<string name="filename" value="%s"/>' % self.curve()
            place = self.place(x, y, size, size, False)
        else:
            place = self.place(x, y, size, size)
        if k in ("obj", "serialized"):
            props += '<string name="filename" value="%s"/>' % (self.obj() if k == "obj" else self.serialized())
            if self.maybe(.3):
                props += self.flag("face_normals")
        if k == "ply":
            attribute = self.r.choice([None, "vertex_color", "face_color"])
            props += '<string name="filename" value="%s"/>' % self.ply(attribute)
            if attribute:
                self.kind("mesh_attribute")
                material = '<bsdf type="diffuse"><texture type="mesh_attribute" name="reflectance"><string name="name" value="%s"/></texture></bsdf>' % attribute
        if k in ("sphere", "cube", "cylinder", "disk", "rectangle") and self.maybe(.15):
            props += self.flag("flip_normals", 1)
            closed = False
        if k == "instance":
            return ('<shape type="shapegroup" id="group%d"><shape type="cube" id="%s_a">%s</shape><shape type="sphere" id="%s_b"><point name="center" x="0" y="0" z="1.4"/><float name="radius" value=".6"/>%s</shape></shape>'
                    '<shape type="instance">%s<ref id="group%d"/></shape><shape type="instance">%s<ref id="group%d"/></shape>'
                    % (self.names, name, self.opaque(bumps=False, maps=not self.from_lights), name, self.opaque(bumps=False, maps=not self.from_lights), self.place(x, y, size, .6 * size), self.names,
                       self.place(x + .5, y + 1.2, size, .5 * size), self.names))
        if material is None and media and closed and self.maybe(.7) and k in ("sphere", "cube"):
            box = ("<translate x='-.5' y='-.5' z='-.5'/><scale value='%g'/><translate x='%g' y='%g' z='%g'/>" % (4 * size, x, y, size))
            material = ('<bsdf type="null"/>' if self.maybe(.5) else self.clear() if self.maybe(.6) else self.holes()) + self.medium("interior", box)
        elif k in ("bsplinecurve", "linearcurve"):
            material = self.opaque(bumps=False, maps=not self.from_lights)
            if k == "linearcurve":  # Mitsuba's frame does not follow it: the same roughness in all directions
                material = re.sub(r'<float name="(anisotropic|alpha_v)"[^>]*>', "", material).replace('"alpha_u"', '"alpha"')
        elif material is None:
            material = self.material(closed, holes)
        return '<shape type="%s" id="%s">%s%s%s%s</shape>' % (k, name, props, place, material, inside)

    # ---- lights ---------------------------------------------------------------------
    def emission(self, name, lo, hi, texture=False):
        k = self.r.random()
        if texture and k < .5:
            return self.light_texels(name, lo, hi)
        if k < .85:
            return self.color(name, lo, hi)
        return '<spectrum name="%s" value="%s"/>' % (name, ", ".join("%d:%g" % (nm, self.u(lo, hi)) for nm in (380, 480, 560, 640, 780)))

    def light_texels(self, name, lo, hi):
        return self.bitmap(name, *((.1, .95) if self.mode == "spectral" else (lo, hi)), linear=True)

    def look(self, x, y, z):
        return '<transform name="to_world"><lookat origin="%g,%g,%g" target="%g,%g,0" up="0,1,0"/></transform>' % (x, y, z, self.u(-1, 1), self.u(-1, 1))

    def light(self, k):
        x, y, z = self.u(-2, 2), self.u(-2, 1), self.u(3, 4)
        self.names += 1
        self.kind(k)
        name = "light%d" % self.names
        out = '<emitter type="%s" id="%s">' % (k, name)
        if k == "area":
            shape = self.r.choice(["rectangle", "disk", "sphere", "obj", "cube", "cylinder"])
            place = ('<transform name="to_world"><scale value="%g"/><rotate x="1" angle="%g"/><translate x="%g" y="%g" z="%g"/></transform>'
                     % (self.u(.4, .9), self.u(150, 210), x, y, z))
            props = '<string name="filename" value="%s"/><boolean name="face_normals" value="true"/>' % self.obj() if shape == "obj" else ""
            radiance = self.emission("radiance", 1, 6, shape in ("rectangle", "disk", "sphere"))
            if shape == "sphere" and "<texture" in radiance:  # Mitsuba's light samples of these are others than its BSDF samples
                radiance = '<spectrum name="radiance" value="3"/>'
            return '<shape type="%s" id="%s">%s%s<emitter type="area">%s</emitter></shape>' % (shape, name, props, place, radiance)
        if k == "directionalarea":
            return ('<shape type="%s" id="%s"><transform name="to_world"><scale value="%g"/><rotate x="1" angle="%g"/><translate x="%g" y="%g" z="%g"/></transform>'
                    '<emitter type="directionalarea">%s</emitter></shape>' % (self.r.choice(["rectangle", "disk"]), name, self.u(.8, 1.6), self.u(160, 200), x, y, z,
                                                                             self.emission("radiance", 1, 3)))
        if k == "point":
            out += '<point name="position" x="%g" y="%g" z="%g"/>' % (x, y, z) + self.emission("intensity", 4, 16)
        elif k == "spot":
            out += self.look(x, y, z) + self.emission("intensity", 10, 40) + self.number("cutoff_angle", 25, 45)
            if self.maybe(.5):
                out += self.number("beam_width", 8, 20)
            if self.maybe(.4):
                out += self.bitmap("texture", .1, 1, linear=True)
        elif k == "directional":
            out += '<vector name="direction" x="%g" y="%g" z="-1"/>' % (self.u(-.6, .6), self.u(-.6, .6)) + self.emission("irradiance", 1, 4)
        elif k == "projector":
            out += self.look(x, y, z) + self.light_texels("irradiance", .2, 3) + self.number("scale", 2, 6) + self.number("fov", 30, 60)
        elif k == "constant":
            out += self.emission("radiance", .2, 1)
        elif k == "envmap":
            w, h = self.r.randint(4, 8), self.r.randint(3, 6)
            data = []
            for _ in range(w * h):
                t = [self.r.uniform(.1, 1) for _ in range(3)]
                data += [t[0]] * 3 if self.mode == "spectral" else t
            file = self.file("pfm")
            pfm_write(self.path(file), w, h, data)
            out += '<string name="filename" value="%s"/>' % file + self.number("scale", .5, 2)
            out += '<transform name="to_world"><rotate x="1" angle="90"/><rotate z="1" angle="%g"/></transform>' % self.u(0, 360)
        elif k == "sunsky":
            out += self.number("turbidity", 1.5, 8) + self.number("sky_scale", .03, .08)
            out += '<float name="sun_scale" value="%g"/>' % (self.u(.0002, .001) if self.mode == "spectral" else 0)
            out += '<vector name="sun_direction" x="%g" y="%g" z="1"/>' % (self.u(-1, 1), self.u(-1, 1))
            if self.maybe(.5):
                out += self.ground("albedo", .1, .8)
        return out + "</emitter>"

    # ---- the whole ------------------------------------------------------------------
    def sensor(self, pinhole=False, meter=False):
        k = self.r.choice(["perspective"] * 6 + ["thinlens", "thinlens", "orthographic", "batch", "distant"] + (["irradiancemeter"] if meter else []))
        k = self.kind("perspective" if pinhole else k)
        filter_ = self.kind(self.r.choice(["box"] * 6 + ["tent", "gaussian", "mitchell", "catmullrom", "lanczos"]) if k != "batch" else "box")
        size = 1 if k in ("distant", "irradiancemeter") else 16
        film = ('<film type="hdrfilm"><integer name="width" value="%d"/><integer name="height" value="%d"/><string name="component_format" value="float32"/>'
                '<string name="pixel_format" value="rgb"/><rfilter type="%s"/></film><sampler type="independent"/>' % (size, size, filter_ if size > 1 else "box"))
        def look(scale=""):
            return ('<transform name="to_world">%s<lookat origin="%g,%g,%g" target="%g,%g,%g" up="0,0,1"/></transform>'
                    % (scale, self.u(-3, 3), self.u(-7, -5), self.u(1.5, 3.5), self.u(-.5, .5), 0, self.u(.3, 1)))
        if k == "perspective":
            return '<sensor type="perspective">%s%s%s</sensor>' % (self.number("fov", 35, 55), look(), film)
        if k == "thinlens":
            return '<sensor type="thinlens">%s%s%s%s%s</sensor>' % (self.number("fov", 35, 55), self.number("aperture_radius", .05, .3), self.number("focus_distance", 4, 8), look(), film)
        if k == "orthographic":
            return '<sensor type="orthographic">%s%s</sensor>' % (look('<scale x="3" y="3"/>'), film)
        if k == "batch":
            return '<sensor type="batch">%s%s%s</sensor>' % (
                '<sensor type="perspective">%s%s</sensor>' % (self.number("fov", 35, 55), look()),
                '<sensor type="thinlens">%s%s%s%s</sensor>' % (self.number("fov", 35, 55), self.number("aperture_radius", .05, .3), self.number("focus_distance", 4, 8), look()), film)
        if k == "distant":
            return '<sensor type="distant"><vector name="direction" x="%g" y="%g" z="-1"/><point name="ray_target" x="0" y="0" z=".2"/>%s</sensor>'.replace("ray_target", "target") % (
                self.u(-.5, .5), self.u(-.5, .5), film)
        return ('<shape type="rectangle" id="meter"><transform name="to_world"><scale value=".7"/><translate x="%g" y="%g" z=".05"/></transform>'
                '<bsdf type="diffuse"/><sensor type="irradiancemeter">%s</sensor></shape>' % (self.u(-1, 1), self.u(-2.4, -1.6), film))

    def scene(self):
        media = self.maybe(.3)
        holes = media or self.maybe(.3)
        integrator = "volpath" if media or holes else self.r.choice(["path", "path", "direct", "volpath"])
        depth = self.r.randint(2, 5) if not media else self.r.randint(4, 8)
        lights = ["area", "point", "spot", "directional", "projector", "constant", "envmap", "area"]
        if self.mode != "mono":
            lights.append("sunsky")
        chosen = self.r.sample(lights, self.r.choice([1, 2, 2]))
        around = [k for k in chosen if k in ("constant", "envmap", "sunsky")]
        chosen = [k for k in chosen if k not in around[1:]]
        beam = not (media or holes) and self.maybe(.12)
        if beam:  # only light walks find it in Mitsuba
            integrator, chosen, self.from_lights = "ptracer", ["directionalarea"], True
        out = '<scene version="3.0.0">\n'
        self.kind(integrator)
        out += '<integrator type="%s">' % integrator
        if integrator != "direct":
            out += '<integer name="max_depth" value="%d"/>' % depth
        elif self.maybe(.4):
            out += '<integer name="emitter_samples" value="2"/><integer name="bsdf_samples" value="1"/>' if not {"point", "spot", "projector", "directional", "sunsky"} & set(chosen) else ""
        if integrator != "ptracer" and self.maybe(.25):
            out += self.flag("hide_emitters", 1)
        out += "</integrator>\n"
        sensor = self.sensor(beam, "hide_emitters" not in out and not {"point", "spot", "directional", "projector", "sunsky"} & set(chosen))
        out += sensor + "\n"
        out += "\n".join(self.light(k) for k in chosen) + "\n"
        out += '<shape type="rectangle" id="floor"><transform name="to_world"><scale value="4"/></transform>%s</shape>\n' % self.material(False, False)
        if self.maybe(.6):
            out += ('<shape type="rectangle" id="wall"><transform name="to_world"><scale value="4"/><rotate x="1" angle="90"/><translate y="3" z="3"/></transform>%s</shape>\n'
                    % self.material(False, False))
        spots = [(-1.6, .6), (0, -.4), (1.6, .7), (.3, 1.8)]
        self.r.shuffle(spots)
        for x, y in spots[:self.r.randint(2, 4)]:
            # Media must not overlap.
            out += self.body(x, y, self.u(.5, .8) * (.6 if media else 1), holes, media) + "\n"
        return out + "</scene>\n"


def make(seed, mode, folder):
    """Path of the scene file, and the kinds that are in it."""
    maker = Maker(seed, mode, folder)
    text = maker.scene()
    path = os.path.join(folder, "scene.xml")
    with open(path, "w") as f:
        f.write(text)
    return path, sorted(set(maker.kinds))


if __name__ == "__main__":
    print(*make(int(sys.argv[1]), sys.argv[2], sys.argv[3]))
