# SPDX-License-Identifier: Apache-2.0
"""Scenes from files, strings and dictionaries; what is said of bad ones."""
import os
import struct
import tempfile
import warnings
import zlib

import importon as im
import numpy as np
from tap import SCENES, raises, run

T = im.ScalarTransform4f
XML = """<scene version="3.0.0">
 <default name="res" value="8"/>
 <integrator type="path"><integer name="max_depth" value="4"/></integrator>
 <sensor type="perspective"><float name="fov" value="40"/>
  <transform name="to_world"><lookat origin="1, -4, 2" target="0, 0.5, 0" up="0, 0, 1"/></transform>
  <film type="hdrfilm"><integer name="width" value="$res"/><integer name="height" value="$res"/><rfilter type="box"/></film>
  <sampler type="independent"><integer name="sample_count" value="4"/></sampler></sensor>
 <bsdf type="diffuse" id="paint"><rgb name="reflectance" value="0.5, 0.4, 0.3"/></bsdf>
 <shape type="rectangle" id="floor">
  <transform name="to_world"><scale value="2"/><rotate x="1" y="2" z="-0.5" angle="25"/><translate x="0.1" z="-1"/></transform>
  <ref id="paint"/></shape>
 <shape type="sphere" id="ball"><point name="center" x="0.5" y="0" z="0"/><float name="radius" value="0.4"/>
  <bsdf type="conductor" id="metal"><spectrum name="eta" value="400:1.2, 700:0.5"/><spectrum name="k" value="3.5"/></bsdf></shape>
 <emitter type="point" id="lamp"><point name="position" x="0" y="-1" z="3"/><rgb name="intensity" value="9, 8, 7"/></emitter>
 <emitter type="constant" id="sky"><spectrum name="radiance" value="0.25"/></emitter>
</scene>"""


def dictionary():
    return {
        "type": "scene",
        "integrator": {"type": "path", "max_depth": 4},
        "sensor": {"type": "perspective", "fov": 40.0, "to_world": T().look_at([1, -4, 2], [0, .5, 0], [0, 0, 1]),
                   "film": {"type": "hdrfilm", "width": 8, "height": 8, "rfilter": {"type": "box"}},
                   "sampler": {"type": "independent", "sample_count": 4}},
        "paint": {"type": "diffuse", "reflectance": {"type": "rgb", "value": [.5, .4, .3]}},
        "floor": {"type": "rectangle", "bsdf": {"type": "ref", "id": "paint"},
                  "to_world": T().translate([.1, 0, -1]).rotate([1, 2, -.5], 25).scale(2)},
        "ball": {"type": "sphere", "center": [.5, 0, 0], "radius": .4, "bsdf": {
            "type": "conductor", "id": "metal", "eta": {"type": "spectrum", "value": [(400, 1.2), (700, .5)]},
            "k": {"type": "spectrum", "value": 3.5}}},
        "lamp": {"type": "point", "position": [0, -1, 3], "intensity": {"type": "rgb", "value": [9, 8, 7]}},
        "sky": {"type": "constant", "radiance": {"type": "spectrum", "value": .25}}}


def test_dictionary_is_the_file():
    """A dictionary and the same scene as XML: the same parameters and picture"""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", im.ImportonWarning)  # the axis is normalised
        a, b = im.load_string(XML), im.load_dict(dictionary())
    pa, pb = im.traverse(a), im.traverse(b)
    assert list(pa) == list(pb), (list(pa), list(pb))
    for name in pa:
        assert np.array_equal(pa[name], pb[name]), name
    ia, ib = im.render(a, spp=16), im.render(b, spp=16)
    assert np.allclose(ia, ib, rtol=1e-5, atol=1e-6), abs(ia - ib).max()


def test_defaults():
    """Keywords fill $defaults, of any type; an unknown one is a TypeError"""
    assert im.load_file(os.path.join(SCENES, "cornell.xml"), res=16, spp=2).sensors[0][2:5] == (16, 16, 2)
    assert im.load_string(XML, res="12").sensors[0].width == 12
    raises(TypeError, lambda: im.load_file(os.path.join(SCENES, "cornell.xml"), rez=16), "rez", "'res'")
    raises(TypeError, lambda: im.load_string(XML, res=object()), "res")
    raises(TypeError, lambda: im.render(im.load_string(XML), ssp=4), "ssp")


def test_modes():
    """Colour modes by keyword and by Mitsuba's variants"""
    assert im.load_string(XML, mode="mono").channels == 1
    try:
        im.set_variant("cuda_ad_mono")
        assert im.load_string(XML).mode == "mono" and im.load_dict(dictionary()).mode == "mono"
    finally:
        im.set_variant("scalar_rgb")
    raises(im.ArgumentError, lambda: im.load_string(XML, mode="rbg"), "rbg", "rgb, mono")
    raises(im.ArgumentError, lambda: im.set_variant("llvm_ad_polarized"), "llvm_ad_polarized")


def test_errors_have_places():
    """Errors have file, line and column, and a class by status"""
    with open("bad.xml", "w") as f:
        f.write("<scene version='3.0.0'>\n  <shape type='sphere'><float name='radious' value='1'/></shape>\n</scene>")
    e = raises(im.Error, lambda: im.load_file("bad.xml"), "radious")
    assert e.file.endswith("bad.xml") and e.line == 2 and e.column > 0, (e.file, e.line, e)
    e = raises(im.UnsupportedError, lambda: im.load_string(XML.replace("diffuse", "difuse"), name="room"), "diffuse")
    assert e.file == "room" and isinstance(e, NotImplementedError)
    raises(im.FileError, lambda: im.load_file("none.xml"), "none.xml")
    raises(OSError, lambda: im.load_file("none.xml"))
    raises(im.SceneError, lambda: im.load_string("<scene"))


def test_dictionary_errors():
    """Bad dictionaries: the object and the property are named"""
    def change(path, value):
        d = dictionary()
        at = d
        for key in path[:-1]:
            at = at[key]
        at[path[-1]] = value
        return lambda: im.load_dict(d)
    raises(im.Error, change(("ball", "radious"), 1.0), "radious", "ball")
    raises(im.UnsupportedError, change(("ball", "type"), "spere"), "spere", "sphere")
    raises(im.ArgumentError, change(("ball",), {"radius": 1}), "ball", "type")
    raises(im.ArgumentError, change(("paint", "reflectance"), {"type": "rgb", "value": [1, 2]}), "reflectance")
    raises(im.Error, change(("lamp", "position"), [0, float("nan"), 0]), "position")
    raises(im.Error, change(("floor", "bsdf"), {"type": "ref", "id": "pant"}), "pant")
    raises(im.ArgumentError, change(("paint", "reflectance"), {"type": "rgb", "value": [1, 1, 1], "x": 1}), "x")
    raises(im.ArgumentError, change(("sky", "radiance"), {"type": "spectrum", "value": "no.spd"}), "no.spd")
    raises(im.ArgumentError, change(("ball", "center"), "a b".split()), "center")
    raises(im.ArgumentError, change(("ball", "center"), 1j), "center")
    raises(im.ArgumentError, change(("type",), "shape"), "scene")
    raises(TypeError, lambda: im.load_dict([]))
    raises(TypeError, lambda: im.load_dict({"type": "scene", 3: {}}))
    raises(im.Error, change(("ball", "radius"), "x\0y"))


def test_meshes_and_bitmaps():
    """Meshes and pixels from arrays; their errors"""
    d = dictionary()
    pixels = np.random.default_rng(1).random((4, 6, 3)).astype(np.float32)
    positions = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], float)
    d["sheet"] = {"type": "mesh", "vertex_positions": positions.T.copy().T, "faces": [[0, 1, 2], [0, 2, 3]],
                  "vertex_texcoords": positions[:, :2],
                  "bsdf": {"type": "diffuse", "id": "cloth", "reflectance": {"type": "bitmap", "bitmap": pixels, "raw": True}}}
    s = im.load_dict(d)
    p = im.traverse(s)
    name = [n for n in p if n.startswith("cloth")][0]
    assert p[name].shape == (4, 6, 3) and np.allclose(p[name], pixels, atol=1e-7)
    assert im.render(s, spp=2).mean() > 0
    d["sheet"]["faces"] = [[0, 1, 4]]
    raises(im.ArgumentError, lambda: im.load_dict(d), "faces")
    d["sheet"]["faces"] = [[0, 1, -1]]
    raises(im.ArgumentError, lambda: im.load_dict(d), "faces")
    d["sheet"]["faces"], d["sheet"]["vertex_texcoords"] = [[0, 1, 2]], [[0, 0]]
    raises(im.ArgumentError, lambda: im.load_dict(d), "uvs")
    del d["sheet"]["vertex_texcoords"]
    d["sheet"]["vertex_positions"] = positions * np.nan
    raises(im.Error, lambda: im.load_dict(d))

def png(path, pixels):
    """A PNG of uint8 or uint16 [h][w][channels]"""
    h, w, channels = pixels.shape
    rows = b"".join(b"\0" + row.astype(">u%d" % pixels.itemsize).tobytes() for row in pixels)
    chunks = [(b"IHDR", struct.pack(">IIBBBBB", w, h, 8 * pixels.itemsize, {1: 0, 3: 2, 4: 6}[channels], 0, 0, 0)),
              (b"IDAT", zlib.compress(rows)), (b"IEND", b"")]
    with open(path, "wb") as f:
        f.write(b"\x89PNG\r\n\x1a\n")
        for kind, data in chunks:
            f.write(struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data)))


class Bitmap:
    """As Mitsuba's: an array interface, and whether values are encoded"""
    def __init__(self, pixels, encoded):
        self.pixels, self.encoded = pixels, encoded
        self.__array_interface__ = pixels.__array_interface__

    def srgb_gamma(self):
        return self.encoded


class Mesh:
    """As Mitsuba's: flat buffers"""
    class_name = "SmoothDiffuse"

    def __init__(self, bsdf="SmoothDiffuse[reflectance=[value=0.5]]"):
        self.text = bsdf

    def __str__(self):
        return self.text

    def bsdf(self):
        return self

    def vertex_positions_buffer(self):
        return np.array([-1, -1, 0, 1, -1, 0, 0, 1, 0], np.float32)

    def faces_buffer(self):
        return np.array([0, 1, 2], np.uint32)

    def has_vertex_normals(self):
        return False

    has_vertex_texcoords = has_vertex_normals


def texels(picture, raw=False, sky=False, key="bitmap"):
    d = dictionary()
    if sky:
        d["sky"] = {"type": "envmap", key: picture}
    else:
        d["paint"]["reflectance"] = {"type": "bitmap", key: picture, "raw": raw}
    p = im.traverse(im.load_dict(d))
    return p[[n for n in p if np.ndim(p[n]) == 3][0]]


def test_pictures_of_whole_numbers():
    """Arrays and bitmaps of 8 and 16 bits are what a file of them is, raw or not; alpha is left out"""
    rng = np.random.default_rng(2)
    assert abs(texels(np.full((2, 2, 3), 128, np.uint8)) - .21586).max() < 1e-5
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "a.png")
        for dtype in (np.uint8, np.uint16):
            for channels in (1, 3, 4):
                pixels = rng.integers(0, np.iinfo(dtype).max, (3, 5, channels), endpoint=True).astype(dtype)
                png(path, pixels)
                for raw in (False, True):
                    if raw and dtype == np.uint16:
                        continue
                    file = texels(path, raw, key="filename")
                    for given in (pixels, Bitmap(pixels, True)):
                        for key in ("bitmap", "data", "filename"):
                            assert np.allclose(texels(given, raw, key=key), file, rtol=2e-7, atol=0), (dtype, channels, raw)
                assert np.allclose(texels(Bitmap(pixels, False)), texels(pixels, raw=True), rtol=2e-7)
                file = texels(path, sky=True, key="filename")
                assert np.allclose(texels(pixels, sky=True), file, rtol=2e-7)
    linear = rng.random((3, 5, 4)).astype(np.float32)
    assert np.array_equal(texels(linear), linear[..., :3]) and np.array_equal(texels(Bitmap(linear, False)), linear[..., :3])
    raises(im.ArgumentError, lambda: texels(np.zeros((2, 2, 3), int)), "bitmap", "uint8")
    raises(im.ArgumentError, lambda: texels(np.zeros((2, 2, 5))), "bitmap", "channels")
    raises(im.ArgumentError, lambda: texels(np.zeros((0, 2))), "bitmap")


def test_grids():
    """Cells of gridvolume from arrays are those of a file; errors name the key"""
    cells = np.random.default_rng(3).random((2, 3, 4)).astype(np.float32)

    def fog(**grid):
        d = dictionary()
        d["integrator"] = {"type": "volpath"}
        d["cloud"] = {"type": "cube", "bsdf": {"type": "null"}, "interior": {
            "type": "heterogeneous", "albedo": .5, "sigma_t": {"type": "gridvolume", **grid}}}
        s = im.load_dict(d)
        p = im.traverse(s)
        return p[[n for n in p if np.ndim(p[n]) >= 3][0]], np.array(im.render(s, spp=2))

    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "a.vol")
        with open(path, "wb") as f:
            f.write(b"VOL\x03" + struct.pack("<iiiii6f", 1, 4, 3, 2, 1, 0, 0, 0, 1, 1, 1) + cells.tobytes())
        file, picture = fog(filename=path)
        raises(im.Error, lambda: fog(filename=path, grid=cells), "filename")
    for key in ("grid", "data", "filename"):
        for given in (cells, cells[..., None], cells.tolist()):
            got, seen = fog(**{key: given})
            assert np.array_equal(got, file) and np.array_equal(seen, picture)
    raises(im.ArgumentError, lambda: fog(grid=cells[0]), "sigma_t: grid", "(nz, ny, nx)")
    raises(im.ArgumentError, lambda: fog(grid=np.zeros((2, 2, 2, 2))), "sigma_t: grid")
    raises(im.Error, lambda: fog(grid=cells * np.nan), "values[0]")


def test_tables():
    """Curves, luminaires and measured materials from arrays are those of their files; errors name the key"""
    rng = np.random.default_rng(11)
    strand = np.column_stack([rng.random((6, 3)) - .5, np.full(6, .06)])
    other = strand + np.array([.2, .1, 0, 0])
    angles, turns, candela = np.array([0., 30, 60, 90]), np.array([0., 90]), 5 + rng.random((2, 4))
    unit = np.array([1, 1.15, 1.66]) / 1500
    measured = .1 + .2 * rng.random((9, 9, 18, 3))
    measured[3, 2, 4, 1] = -1 # not measured

    def picture(name, **thing):
        d = dictionary()
        if name == "merl":
            d["ball"]["bsdf"] = {"type": "merl", **thing}
        else:
            d[name] = {"type": name, **thing}
        return np.array(im.render(im.load_dict(d), spp=4))

    with warnings.catch_warnings(), tempfile.TemporaryDirectory() as folder:
        warnings.simplefilter("ignore", im.ImportonWarning)
        path = os.path.join(folder, "a")

        def written(text, ending):
            with open(path + ending, "wb") as f:
                f.write(text)
            return path + ending
        lines = ["\n".join("%.17g %.17g %.17g %.17g" % tuple(p) for p in c) + "\n" for c in (strand, other)]
        ies = "IESNA:LM-63-1995\nTILT=NONE\n1 -1 1 4 2 1 2 0 0 0\n1 1 0\n0 30 60 90\n0 90\n" + " ".join("%.17g" % x for x in candela.ravel())
        table = struct.pack("<3i", 9, 9, 18) + b"".join((measured[..., c] / unit[c]).astype("<f8").tobytes() for c in range(3))
        plain = picture("ball2", type="sphere", radius=1e-3)
        for name, text, ending, arrays in (
                ("bsplinecurve", lines[0].encode(), ".txt", {"control_points": strand}),
                ("bsplinecurve", lines[0].encode(), ".txt", {"control_points": strand.tolist()}),
                ("bsplinecurve", "\n".join(lines).encode(), ".txt", {"control_points": [strand, other]}),
                ("linearcurve", "\n".join(lines).encode(), ".txt", {"control_points": np.stack([strand, other])}),
                ("ies", ies.encode(), ".ies", {"candela": candela, "vertical_angles": angles, "horizontal_angles": turns}),
                ("merl", table, ".binary", {"data": measured})):
            file = picture(name, filename=written(text, ending))
            assert np.array_equal(picture(name, **arrays), file) and not np.array_equal(file, plain), name
            raises(im.ArgumentError, lambda: picture(name, filename=path + ending, **arrays), name if name != "merl" else "bsdf", "filename")
    raises(im.ArgumentError, lambda: picture("bsplinecurve", control_points=strand[:, :3]), "control_points", "4")
    raises(im.ArgumentError, lambda: picture("bsplinecurve", control_points=strand * np.nan), "control_points", "finite")
    raises(im.ArgumentError, lambda: picture("ies", candela=candela), "vertical_angles", "4 angles")
    raises(im.ArgumentError, lambda: picture("ies", candela=candela, vertical_angles=turns), "vertical_angles")
    raises(im.ArgumentError, lambda: picture("merl", data=measured[..., 0]), "data")


def test_objects_of_others():
    """Objects with .matrix, meshes, numbers as arrays; what cannot be read is named"""
    class Transform:
        def __init__(self, matrix):
            self.matrix = matrix
    d = dictionary()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", im.ImportonWarning)
        picture = np.array(im.render(im.load_dict(d), spp=2))
    for matrix in (d["floor"]["to_world"].matrix, d["floor"]["to_world"].matrix[..., None]):
        d["floor"]["to_world"] = Transform(matrix)
        assert np.array_equal(im.render(im.load_dict(d), spp=2), picture)
    d["floor"]["to_world"] = Transform(np.eye(3))
    raises(im.ArgumentError, lambda: im.load_dict(d), "to_world", "(3, 3)")
    d = dictionary()
    d["ball"]["radius"], d["ball"]["center"] = np.array([.4]), np.array([[.5], [0], [0]])
    assert np.array_equal(im.render(im.load_dict(d), spp=2), picture)
    d["sheet"] = Mesh()
    d["other"] = {"type": "mesh", "mesh": Mesh("Rough"), "bsdf": {"type": "diffuse", "id": "paper"}}
    assert "paper.reflectance.value" in im.traverse(im.load_dict(d))
    d["sheet"] = Mesh("Rough")
    raises(im.ArgumentError, lambda: im.load_dict(d), "sheet", "BSDF")
    d["sheet"] = object()
    raises(im.ArgumentError, lambda: im.load_dict(d), "sheet", "dictionary")
    d["sheet"] = np.zeros((5, 5))
    raises(im.ArgumentError, lambda: im.load_dict(d), "sheet", "(5, 5)")


def test_transforms():
    """Transforms as Mitsuba composes them, from the class and from an instance"""
    a = T().translate([1, 2, 3]).rotate(axis=[0, 1, 0], angle=90).scale([1, 2, 3])
    b = T.translate([1, 2, 3]) @ T.rotate([0, 1, 0], 90) @ T.scale([1, 2, 3])
    assert a == b and np.allclose(a @ [1, 0, 0], [1, 2, 2]) and hash(a) == hash(b)
    assert np.allclose((a @ a.inverse()).matrix, np.eye(4))
    camera = T.look_at(origin=[0, 0, 4], target=[0, 0, 0], up=[0, 1, 0])
    assert np.allclose(camera @ [0, 0, 1], [0, 0, 3]) and np.allclose(camera.matrix[:3, 0], [-1, 0, 0])
    for bad in (lambda: T.rotate([0, 0, 0], 3), lambda: T.translate([1, 2]), lambda: T(np.eye(3)),
                lambda: T.look_at([0, 0, 0], [0, 0, 0]), lambda: T.look_at([0, 0, 0], [0, 1, 0], [0, 1, 0])):
        raises(im.ArgumentError, bad)


def test_cornell_box():
    """Mitsuba's dictionary of the Cornell box"""
    s = im.load_dict(im.cornell_box(res=16, spp=8))
    assert s.n_emitters == 1 and s.sensors[0].spp == 8 and s.max_depth == 8
    assert len(im.traverse(s)) == 4
    assert "rectangle" not in repr(s) and "dictionary" in repr(s)


def test_warnings():
    """What the library warns of are Python warnings, at the caller's place"""
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        im.load_string(XML)
    assert any(issubclass(w.category, im.ImportonWarning) and "axis" in str(w.message) for w in said)
    assert {os.path.basename(w.filename) for w in said} == {"scenes.py"}


def test_keywords():
    """Unknown keywords are a TypeError that says what was meant; errors further inside are as they were"""
    s = im.load_dict(im.cornell_box(res=8))
    for call, *words in ((lambda: im.render(s, ssp=4), "render()", "'ssp'", "'spp'"), (lambda: im.fit(s, s, optimiser="lm"), "'optimizer'"),
                         (lambda: im.loss(s, s, weigths=1), "'weights'"), (lambda: im.compare(1, 2, qqq=3), "n_reference"),
                         (lambda: im.ad.Adam(lr=1, beta1=.9), "Adam()", "'beta_1'"), (lambda: im.write("a.exr", s, exposur=1), "'exposure'"),
                         (lambda: im.elements.Elements(s, stop=.5, max_level=2).fit([1.0], max_iteration=3), "'max_iterations'")):
        raises(TypeError, call, *words)

    def own(p, wrong=1):
        return im.render(s, spp=2, progress=lambda p: own(ssp=1))
    raises(TypeError, lambda: im.part(lambda: own(sspp=1), 1, 2), "sspp")
    assert im.render.__module__ == "importon" and "spp" in im.render.__doc__


run(globals())
