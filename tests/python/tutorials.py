# SPDX-License-Identifier: Apache-2.0
"""Dictionaries as tutorials of Mitsuba 3 write them load unchanged: each has the parameters
and numbers that it should have, and a finite picture. Objects of Mitsuba's have stand-ins
with the attributes that theirs have."""
import copy
import warnings

import importon as im
import numpy as np
from tap import raises, run

RNG = np.random.default_rng(3)
BYTES = RNG.integers(0, 256, (4, 6, 4)).astype(np.uint8)
FLOATS = RNG.random((8, 16, 3)).astype(np.float32)
CELLS = RNG.random((3, 4, 5)).astype(np.float32)
GREY = ((np.arange(256) / 255 + .055) / 1.055)**2.4
GREY[:11] = np.arange(11) / 255 / 12.92


class Transform:
    """As Mitsuba's: matrices from the left of a point, `@` and methods that go on from it"""
    def __init__(self, matrix=None):
        self.matrix = np.eye(4) if matrix is None else np.array(matrix, float)

    def __matmul__(self, other):
        return Transform(self.matrix @ other.matrix)

    def translate(self, v):
        m = np.eye(4)
        m[:3, 3] = v
        return Transform(self.matrix @ m)

    def scale(self, v):
        return Transform(self.matrix @ np.diag([*np.broadcast_to(v, 3), 1]))

    def rotate(self, axis, angle):
        return Transform(self.matrix @ im.ScalarTransform4f().rotate(axis, angle).matrix)

    def look_at(self, origin, target, up):
        return Transform(self.matrix @ im.ScalarTransform4f().look_at(origin, target, up).matrix)


class Bitmap:
    """As Mitsuba's: an array interface, and whether values are encoded"""
    def __init__(self, pixels):
        self.pixels = pixels
        self.__array_interface__ = pixels.__array_interface__

    def srgb_gamma(self):
        return self.pixels.dtype == np.uint8


class Tensor:
    """As Dr.Jit's: an array by __array__ alone, with an attribute `matrix` that is no matrix (a swizzle)"""
    def __init__(self, numbers):
        self.numbers = np.asarray(numbers, np.float32)
        self.matrix = np.zeros(6)

    def __array__(self, dtype=None, copy=None):
        return np.asarray(self.numbers, dtype)


class Mesh:
    """As Mitsuba's: flat buffers, a default BSDF"""
    def bsdf(self):
        return None

    def vertex_positions_buffer(self):
        return Tensor([-1, -1, 0, 1, -1, 0, 0, 1, 0])

    def faces_buffer(self):
        return np.array([0, 1, 2], np.uint32)

    def has_vertex_normals(self):
        return False

    def has_vertex_texcoords(self):
        return True

    def vertex_texcoords_buffer(self):
        return Tensor([0, 0, 1, 0, .5, 1])


T = Transform


def scene(**objects):
    """A camera of 8 x 8 pixels under a sky, and the objects"""
    d = {"type": "scene", "integrator": {"type": "path", "max_depth": 4},
         "sensor": {"type": "perspective", "fov": 45, "to_world": T().look_at([0, -4, 2], [0, 0, 0], [0, 0, 1]),
                    "film": {"type": "hdrfilm", "width": 8, "height": 8, "pixel_format": "rgb",
                             "rfilter": {"type": "gaussian"}},
                    "sampler": {"type": "multijitter", "sample_count": 4}},
         "light": {"type": "constant"}}
    d.update(objects)
    return d


def loads(d, **numbers):
    """The dictionary is as it was, its picture finite and not black, and parameters have these numbers (names
    with __ for the dots)"""
    before = copy.deepcopy({k: v for k, v in d.items() if not hasattr(v, "vertex_positions_buffer")})
    s = im.load_dict(d)
    assert str(before) and set(before) <= set(d) and all(
        set(before[k]) == set(d[k]) for k in before if isinstance(d[k], dict)), "the dictionary has changed"
    picture = np.asarray(im.render(s, spp=4))
    assert np.all(np.isfinite(picture)) and picture.max() > 0
    p = im.traverse(s)
    for name, value in numbers.items():
        name = name.replace("__", ".")
        assert name in p, (name, list(p))
        assert np.allclose(np.asarray(p[name]), value, rtol=1e-5, atol=1e-7), (name, p[name], value)


def test_cornell_box():
    """1: the Cornell box, with transforms of another program, prb, a tent and a crop"""
    d = im.cornell_box(res=8, spp=4)
    for o in d.values():
        if isinstance(o, dict) and "to_world" in o:
            o["to_world"] = T(o["to_world"].matrix)
    d["integrator"] = {"type": "prb", "max_depth": 6, "rr_depth": 5, "hide_emitters": False}
    d["sensor"]["film"].update(rfilter={"type": "tent"}, crop_width=4, crop_height=4, crop_offset_x=2, crop_offset_y=2)
    loads(d, white__reflectance__value=[.885809, .698859, .666422])


def test_bytes_as_reflectance():
    """2: an 8-bit bitmap with alpha, scaled and repeated"""
    tiles = {"type": "bitmap", "bitmap": Bitmap(BYTES), "wrap_mode": "repeat", "filter_type": "nearest",
             "to_uv": T().scale([2, 2, 1])}
    loads(scene(floor={"type": "rectangle", "bsdf": {"type": "diffuse", "id": "mat", "reflectance": tiles}}),
          mat__reflectance__data=GREY[BYTES[..., :3]])


def test_tensors_as_textures():
    """3: a principled material behind `twosided`, with tensors of floats and of one channel"""
    loads(scene(floor={"type": "rectangle", "bsdf": {"type": "twosided", "nested": {
        "type": "principled", "id": "skin", "metallic": .5, "specular": np.float64(.4),
        "base_color": {"type": "bitmap", "data": Tensor(FLOATS), "raw": True},
        "roughness": {"type": "bitmap", "data": FLOATS[..., :1], "raw": True}}}}),
        skin__base_color__data=FLOATS)


def test_bytes_as_mask():
    """4: an opacity of uint8 grey, nested material under any key"""
    loads(scene(leaf={"type": "rectangle", "bsdf": {
        "type": "mask", "id": "leaf_mask", "opacity": {"type": "bitmap", "data": BYTES[..., 0], "raw": True},
        "material": {"type": "diffuse", "reflectance": {"type": "rgb", "value": (.1, .7, .2)}}}}),
        leaf_mask__opacity__data=BYTES[..., 0:1] / 255)


def test_environment_bitmap():
    """5: an environment as `bitmap`, turned and scaled, over rough gold"""
    loads(scene(light={"type": "envmap", "bitmap": Bitmap(FLOATS), "scale": 2.0, "to_world": T().rotate([1, 0, 0], 90)},
                ball={"type": "sphere", "bsdf": {"type": "roughconductor", "material": "Au", "distribution": "ggx",
                                                 "alpha": .1}}), light__data=FLOATS, light__scale__value=2)


def test_environment_data():
    """6: an environment as `data`, over glass"""
    loads(scene(light={"type": "envmap", "data": FLOATS},
                ball={"type": "sphere", "center": Tensor([0, 0, .5]), "radius": np.float32(.5),
                      "bsdf": {"type": "dielectric", "int_ior": "bk7", "ext_ior": 1.0}}), light__data=FLOATS)


def test_volumes():
    """7: a heterogeneous medium of two grids, by `grid` and by `data`"""
    place = T().translate([-1, -1, -1]).scale(2.0)
    color = np.stack([CELLS * .9] * 3, axis=-1)
    loads(scene(integrator={"type": "prbvolpath", "max_depth": 8, "rr_depth": 1000, "hide_emitters": True},
                cube={"type": "cube", "bsdf": {"type": "null"}, "interior": {
                    "type": "heterogeneous", "id": "smoke", "scale": 4.0, "phase": {"type": "hg", "g": .3},
                    "albedo": {"type": "gridvolume", "data": Tensor(color), "to_world": place},
                    "sigma_t": {"type": "gridvolume", "grid": CELLS[..., None], "to_world": place,
                                "filter_type": "trilinear"}}}),
          smoke__sigma_t__data=CELLS)


def test_mesh_objects():
    """8: a mesh of another program, by itself, and under a material"""
    loads(scene(m=Mesh()))
    loads(scene(m={"type": "mesh", "mesh": Mesh(), "bsdf": {"type": "diffuse", "id": "paper"}}),
          paper__reflectance__value=.5)


def test_mesh_arrays():
    """9: arrays of vertices and faces, of any type of numbers, that shine"""
    loads(scene(m={"type": "mesh", "vertices": [[-1, -1, 0], [1, -1, 0], [0, 1, 0]], "faces": np.array([[0, 1, 2]], np.int64),
                   "emitter": {"type": "area", "radiance": {"type": "rgb", "value": np.array([1, 2, 3])}}}),
          m__emitter__radiance__value=[1, 2, 3])


def test_blends():
    """10: materials in materials, a checkerboard between them"""
    loads(scene(b={"type": "sphere", "bsdf": {
        "type": "blendbsdf", "weight": {"type": "checkerboard", "to_uv": T().scale([4, 4, 1])},
        "bsdf_0": {"type": "plastic", "id": "a", "diffuse_reflectance": {"type": "rgb", "value": .25}},
        "bsdf_1": {"type": "conductor", "material": "none"}}}), a__diffuse_reflectance__value=.25)


def test_normals():
    """11: a normal map and a bump map"""
    loads(scene(b={"type": "rectangle", "bsdf": {
        "type": "normalmap", "normalmap": {"type": "bitmap", "raw": True, "bitmap": Bitmap(BYTES)},
        "bsdf": {"type": "roughplastic", "alpha": .2}}}))
    loads(scene(b={"type": "rectangle", "bsdf": {
        "type": "bumpmap", "arbitrary": {"type": "bitmap", "raw": True, "data": FLOATS[..., :1]},
        "bsdf": {"type": "diffuse"}, "scale": .1}}))


def test_lights():
    """12: lamps of all kinds, positions and directions as lists, tuples and arrays"""
    down = T().look_at([0, 0, 3], [0, 0, 0], [0, 1, 0])
    loads(scene(s={"type": "spot", "to_world": down, "cutoff_angle": 30, "intensity": {"type": "spectrum", "value": 3.0}},
                d={"type": "directional", "direction": (1, 0, -1), "irradiance": {"type": "rgb", "value": 1.0}},
                p={"type": "point", "position": np.array([0, 1, 2]), "intensity": {"type": "rgb", "value": [1, 2, 3]}},
                pr={"type": "projector", "fov": 30, "to_world": down, "irradiance": {
                    "type": "bitmap", "bitmap": Bitmap(FLOATS), "raw": True}},
                f={"type": "rectangle"}), p__intensity__value=[1, 2, 3])


def test_spectra():
    """13: spectra as objects, lists and pairs, in a spectral variant"""
    d = scene(f={"type": "rectangle", "bsdf": {"type": "diffuse", "id": "grey", "reflectance": {
        "type": "irregular", "wavelengths": "400, 500, 600", "values": ".1, .5, .7"}}},
        g={"type": "cube", "bsdf": {"type": "diffuse", "id": "list", "reflectance": {
            "type": "spectrum", "value": [(400, .1), (700, .6)]}}},
        e={"type": "sphere", "emitter": {"type": "area", "radiance": {"type": "d65", "scale": 2.0}}},
        light={"type": "constant", "radiance": {"type": "blackbody", "temperature": 5000.0, "scale": 1e-3}})
    try:
        im.set_variant("llvm_ad_spectral")
        loads(d, grey__reflectance__values=[.1, .5, .7], list__reflectance__values=[.1, .6])
    finally:
        im.set_variant("scalar_rgb")


def test_instances_and_several_sensors():
    """14: instances of a group, an array as transform, `aov`, and two cameras in a batch"""
    place = np.eye(4)
    place[0, 3] = 1
    loads(scene(integrator={"type": "aov", "aovs": "depth:depth, nn:sh_normal", "img": {"type": "path"}},
                g={"type": "shapegroup", "a": {"type": "sphere", "bsdf": {"type": "diffuse", "id": "clay"}},
                   "b": {"type": "cube"}},
                i={"type": "instance", "to_world": place, "shapegroup": {"type": "ref", "id": "g"}}),
          clay__reflectance__value=.5)
    eye = {"type": "perspective", "fov": 45, "to_world": T().look_at([0, -4, 2], [0, 0, 0], [0, 0, 1])}
    loads(scene(sensor={"type": "batch", "a": dict(eye), "b": dict(eye), "film": {
        "type": "hdrfilm", "width": 16, "height": 8, "rfilter": {"type": "box"}}}, ball={"type": "sphere"}))


def test_references():
    """15: a reference names an object by its key or by its id"""
    for id in ("paint", "mat-paint"):
        loads(scene(paint={"type": "diffuse", "id": "mat-paint", "reflectance": {"type": "rgb", "value": .25}},
                    ball={"type": "sphere", "bsdf": {"type": "ref", "id": id}}), **{"mat-paint__reflectance__value": .25})
    # An object's own id comes before the key of another.
    loads(scene(a={"type": "diffuse", "id": "b", "reflectance": {"type": "rgb", "value": .25}},
                c={"type": "diffuse", "id": "a", "reflectance": {"type": "rgb", "value": .75}},
                ball={"type": "sphere", "bsdf": {"type": "ref", "id": "a"}}), a__reflectance__value=.75)


def test_messages():
    """What cannot be read is named by object, type and key, with what to write"""
    raises(im.ArgumentError, lambda: im.load_dict(scene(box={"type": "sdfgrid", "grid": CELLS})), "'box' (sdfgrid)",
           "grid", "gridvolume")
    raises(im.ArgumentError, lambda: im.load_dict(scene(b={"type": "sphere", "bsdf": object()})), "'b' (sphere)", "bsdf",
           "dictionary")
    raises(im.SceneError, lambda: im.load_dict(scene(b={"type": "sphere", "bsdf": {
        "type": "diffuse", "reflectance": [.1, .2, .3]}})), "reflectance", "rgb")
    raises(im.ArgumentError, lambda: im.load_dict(scene(b={"type": "sphere", "bsdf": {
        "type": "diffuse", "reflectance": {"type": "bitmap", "data": np.zeros((2, 2, 3), np.int32)}}})), "data",
        "uint8 or uint16")
    raises(im.ArgumentError, lambda: im.load_dict(scene(light={"type": "envmap", "data": np.zeros((2, 2, 5))})), "data",
           "(2, 2, 5)", "3 channels")


run(globals())
