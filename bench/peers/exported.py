# SPDX-License-Identifier: Apache-2.0
"""One scene for each plugin of Mitsuba 3.9, as Mitsuba's own writer exports it: what does importon do with it?

    python3 bench/peers/exported.py [-i IMPORTON] [--keep FOLDER] [NAME ...]

Each plugin stands in a small scene, which mi.parser.write_string writes. `importon info`, `render` and `render --lenient`
are run on it; the table says whether it renders, or what is said to be missing. Ends with 1 if a plugin is refused
without being named by `info`, or if --lenient makes no picture. Without Mitsuba it says so and skips (77).
"""
import argparse
import json
import os
import random
import re
import subprocess
import sys
import tempfile

import random_parts

import needed

mi, np = needed.modules("mitsuba", "numpy")

here = os.path.dirname(os.path.abspath(__file__))
root = os.path.dirname(os.path.dirname(here))
rgb = lambda *c: {"type": "rgb", "value": list(c)}


class Files:
    def __init__(self, folder):
        self.folder, self.maker = folder, random_parts.Maker(7, "rgb", folder)

    def name(self, file):
        return os.path.join(self.folder, file)

    def grid(self, channels=1):
        file, r = self.maker.file("vol"), random.Random(1)
        random_parts.vol_write(self.name(file), [2, 3, 2], channels, [r.uniform(.2, .9) for _ in range(12 * channels)])
        return self.name(file)

    def picture(self):
        r = random.Random(2)
        file = self.maker.file("png")
        random_parts.png_write(self.name(file), 4, 4, 3, [r.randrange(60, 250) for _ in range(48)])
        return self.name(file)

    def sky(self):
        r = random.Random(3)
        file = self.maker.file("pfm")
        random_parts.pfm_write(self.name(file), 4, 3, [r.uniform(.2, 1) for _ in range(36)])
        return self.name(file)

    def measured(self):
        """A diffuse surface of .5 in the form of the RGL's files: all densities even."""
        n, t, w = 4, 3, 3
        even = lambda *shape: np.ones(shape, np.float32)
        table = {"description": np.frombuffer(b"even", np.uint8), "jacobian": np.zeros(1, np.uint8), "theta_i": np.linspace(0, 1.5, t).astype(np.float32),
                 "phi_i": np.array([0], np.float32), "ndf": even(2, n), "sigma": even(2, n), "vndf": even(1, t, n, n), "luminance": even(1, t, n, n),
                 "wavelengths": np.array([400, 550, 700], np.float32), "spectra": .5 * even(1, t, w, n, n)}
        import struct
        kinds = {"uint8": 1, "float32": 10}
        head, body, at = b"", b"", 12 + 2 + 4 + sum(2 + len(k) + 2 + 1 + 8 + 8 * v.ndim for k, v in table.items())
        for k, v in table.items():
            head += struct.pack("<H", len(k)) + k.encode() + struct.pack("<HBQ", v.ndim, kinds[str(v.dtype)], at + len(body)) + struct.pack("<%dQ" % v.ndim, *v.shape)
            body += v.tobytes()
        file = self.name(self.maker.file("bsdf"))
        with open(file, "wb") as f:
            f.write(b"tensor_file\0" + struct.pack("<BBI", 1, 0, len(table)) + head + body)
        return file


def scene(parts, film=None, sensor=None):
    """Parts in front of a camera, over a floor, below a sky."""
    T = mi.ScalarTransform4f
    film = film or {"type": "hdrfilm", "width": 16, "height": 16, "rfilter": {"type": "box"}}
    base = {"type": "scene", "integrator": {"type": "path", "max_depth": 4},
            "camera": sensor or {"type": "perspective", "fov": 40, "to_world": T().look_at([0, -5, 2], [0, 0, .5], [0, 0, 1]), "film": film,
                                 "sampler": {"type": "independent", "sample_count": 4}},
            "sky": {"type": "constant", "radiance": rgb(.4, .5, .6)},
            "floor": {"type": "rectangle", "to_world": T().scale([3, 3, 1]), "bsdf": {"type": "diffuse", "reflectance": rgb(.6, .5, .4)}}}
    base.update(parts)
    return {k: v for k, v in base.items() if v is not None}


def cases(f):
    """name of a plugin -> (concept, scene)."""
    T = mi.ScalarTransform4f
    out = {}
    ball = lambda bsdf, **more: {"ball": {"type": "sphere", "center": [0, 0, .8], "radius": .7, "bsdf": bsdf, **more}}
    grey = {"type": "diffuse", "reflectance": rgb(.4, .4, .4)}
    bitmap = lambda **more: {"type": "bitmap", "filename": f.picture(), **more}
    bsdfs = {
        "blendbsdf": {"weight": .3, "a": grey, "b": {"type": "conductor"}}, "bumpmap": {"t": bitmap(raw=True), "b": grey, "scale": .1},
        "circular": {}, "conductor": {"material": "Au"}, "dielectric": {}, "diffuse": {"reflectance": rgb(.2, .5, .7)},
        "hair": {}, "mask": {"opacity": .5, "b": grey}, "measured": {"filename": f.measured()}, "measured_polarized": {"filename": f.name("none.pbsdf")},
        "normalmap": {"normalmap": bitmap(raw=True), "b": grey}, "null": {}, "plastic": {}, "polarizer": {}, "pplastic": {}, "principled": {"metallic": .5},
        "principledthin": {}, "retarder": {}, "roughconductor": {"alpha": .2}, "roughdielectric": {}, "roughplastic": {}, "thindielectric": {},
        "twosided": {"b": grey}}
    for name, props in bsdfs.items():
        out[name] = "bsdf", scene(ball({"type": name, **props}))
    emitters = {
        "directional": {"direction": [.3, .2, -1], "irradiance": rgb(1, 1, 1)}, "envmap": {"filename": f.sky()}, "constant": {"radiance": rgb(1, 1, 1)},
        "point": {"position": [0, -1, 3], "intensity": rgb(5, 5, 5)}, "projector": {"irradiance": bitmap(), "to_world": T().look_at([0, -2, 3], [0, 0, 0], [0, 0, 1])},
        "spot": {"intensity": rgb(9, 9, 9), "to_world": T().look_at([0, -2, 3], [0, 0, 0], [0, 0, 1])}, "sunsky": {"sun_scale": 0.}, "timed_sunsky": {}}
    for name, props in emitters.items():
        out[name] = "emitter", scene({"sky": {"type": name, **props}, **ball(grey)})
    for name in ("area", "directionalarea"):
        lamp = {"type": "rectangle", "to_world": T().translate([0, 0, 3]).rotate([1, 0, 0], 180), "emitter": {"type": name, "radiance": rgb(3, 3, 3)}}
        out[name] = "emitter", scene({"lamp": lamp, **ball(grey)})
    curve, mesh = f.name(f.maker.curve()), f.name(f.maker.obj())
    centres = f.name("ellipsoids.ply")
    with open(centres, "w") as file:
        file.write("ply\nformat ascii 1.0\nelement vertex 1\n" + "".join("property float %s\n" % k for k in (
            "x", "y", "z", "scale_0", "scale_1", "scale_2", "rot_0", "rot_1", "rot_2", "rot_3")) + "end_header\n0 0 .8 -1 -1 -1 1 0 0 0\n")
    shapes = {
        "bsplinecurve": {"filename": curve}, "cube": {}, "cylinder": {}, "disk": {}, "ellipsoids": {"filename": centres}, "ellipsoidsmesh": {"filename": centres},
        "linearcurve": {"filename": curve}, "obj": {"filename": mesh}, "ply": {"filename": f.name(f.maker.ply(None))}, "rectangle": {},
        "sdfgrid": {"grid": None}, "serialized": {"filename": f.name(f.maker.serialized())}, "sphere": {}, "merge": {"part": {"type": "cube"}}}
    for name, props in shapes.items():
        body = {"type": name, "to_world": T().translate([0, 0, 1]).scale(.6), "bsdf": grey, **props}
        if name == "merge":
            body = {"type": "merge", "part": {"type": "obj", "filename": mesh, "bsdf": grey}}
        if name == "sdfgrid":
            del body["grid"]  # the writer has no tensors: as a file
            body["filename"] = f.grid()
        if name.startswith("ellipsoids"):
            del body["to_world"]
        out[name] = "shape", scene({"body": body})
    group = {"type": "shapegroup", "part": {"type": "cube", "bsdf": grey}}
    for name in ("shapegroup", "instance"):
        out[name] = "shape", scene({"group": group, "copy": {"type": "instance", "to_world": T().translate([0, 0, 1]).scale(.5), "g": {"type": "ref", "id": "group"}}})
    fog = lambda phase, kind="homogeneous", **more: {"integrator": {"type": "volpath", "max_depth": 6}, **ball(
        {"type": "null"}, interior={"type": kind, "sigma_t": 1.5, "albedo": .8, "phase": phase, **more})}
    phases = {"blendphase": {"weight": .4, "a": {"type": "isotropic"}, "b": {"type": "hg", "g": .3}}, "hg": {"g": .5}, "isotropic": {}, "rayleigh": {},
              "sggx": {"S": {"type": "gridvolume", "filename": f.grid(6)}}, "tabphase": {"values": "0.5, 1, 2"}}
    for name, props in phases.items():
        out[name] = "phase", scene(fog({"type": name, **props}))
    out["homogeneous"] = "medium", scene(fog({"type": "isotropic"}))
    grid = {"type": "gridvolume", "filename": f.grid(), "to_world": T().translate([-.7, -.7, .1]).scale(1.4)}
    out["heterogeneous"] = "medium", scene(fog({"type": "isotropic"}, "heterogeneous", sigma_t=grid))
    out["gridvolume"] = "volume", out["heterogeneous"][1]
    out["constvolume"] = "volume", scene(fog({"type": "isotropic"}, albedo={"type": "constvolume", "value": .7}))
    nested = {"aov": {"aovs": "dd:depth,nn:sh_normal", "i": {"type": "path"}}, "moment": {"i": {"type": "path"}}, "stokes": {"i": {"type": "path"}}}
    for name in ("aov", "depth", "direct", "moment", "path", "ptracer", "stokes", "volpath", "volpathmis", "direct_projective", "prb", "prb_basic",
                 "prb_projective", "prbvolpath", "volprim_rf_basic"):
        out[name] = "integrator", scene({"integrator": {"type": name, **nested.get(name, {})}, **ball(grey)})
    tiny = {"type": "hdrfilm", "width": 1, "height": 1, "rfilter": {"type": "box"}}
    at = T().look_at([0, -5, 2], [0, 0, .5], [0, 0, 1])
    film = {"type": "hdrfilm", "width": 16, "height": 16, "rfilter": {"type": "box"}}
    sensors = {"batch": {"a": {"type": "perspective", "to_world": at}, "b": {"type": "thinlens", "aperture_radius": .1, "to_world": at}, "film": film},
               "distant": {"direction": [0, .3, -1], "film": tiny}, "orthographic": {"to_world": at @ T().scale([2, 2, 1]), "film": film},
               "perspective": {"to_world": at, "film": film}, "radiancemeter": {"origin": [0, -3, 2], "direction": [0, 1, -.5], "film": tiny},
               "thinlens": {"aperture_radius": .1, "to_world": at, "film": film}}
    for name, props in sensors.items():
        out[name] = "sensor", scene(ball(grey), sensor={"type": name, **props})
    out["irradiancemeter"] = "sensor", scene({"camera": None, **ball(grey), "plate": {
        "type": "rectangle", "to_world": T().translate([0, 0, .05]), "bsdf": grey, "sensor": {"type": "irradiancemeter", "film": tiny}}})
    for name in ("box", "catmullrom", "gaussian", "lanczos", "mitchell", "tent"):
        out[name] = "rfilter", scene(ball(grey), film={"type": "hdrfilm", "width": 16, "height": 16, "rfilter": {"type": name}})
    out["hdrfilm"] = "film", scene(ball(grey))
    out["specfilm"] = "film", scene(ball(grey), film={"type": "specfilm", "width": 16, "height": 16, "rfilter": {"type": "box"}, "band": {
        "type": "irregular", "wavelengths": "400,500,600", "values": "0,1,0"}})
    for name in ("independent", "ldsampler", "multijitter", "orthogonal", "stratified"):
        out[name] = "sampler", scene(ball(grey), sensor={"type": "perspective", "to_world": at, "film": film, "sampler": {"type": name, "sample_count": 16}})
    textures = {"bitmap": bitmap(), "checkerboard": {"type": "checkerboard"}, "volume": {"type": "volume", "volume": {"type": "gridvolume", "filename": f.grid(3)}},
                "srgb": {"type": "srgb", "color": [.3, .5, .7]}, "uniform": {"type": "uniform", "value": .5}, "rawconstant": {"type": "rawconstant", "value": [.3, .5, .7]},
                "regular": {"type": "regular", "wavelength_min": 400., "wavelength_max": 700., "values": ".2,.5,.7"},
                "irregular": {"type": "irregular", "wavelengths": "400,500,700", "values": ".2,.5,.7"}}
    for name, t in textures.items():
        out[name] = "texture", scene(ball({"type": "diffuse", "reflectance": t}))
    out["mesh_attribute"] = "texture", scene({"body": {"type": "ply", "filename": f.name(f.maker.ply("vertex_color")), "bsdf": {
        "type": "diffuse", "reflectance": {"type": "mesh_attribute", "name": "vertex_color"}}}})
    for name, props in {"d65": {}, "blackbody": {"temperature": 4000.}}.items():
        out[name] = "texture", scene({"sky": {"type": "constant", "radiance": {"type": name, **props}}, **ball(grey)})
    return out


MODE = {"blackbody": "spectral", "regular": "spectral", "specfilm": "spectral"}
VARIANT = {"circular": "scalar_spectral_polarized", "polarizer": "scalar_spectral_polarized", "retarder": "scalar_spectral_polarized", "pplastic": "scalar_spectral_polarized",
           "measured_polarized": "scalar_spectral_polarized", "stokes": "scalar_spectral_polarized", "measured": "scalar_spectral"}
PYTHON = ("direct_projective", "prb", "prb_basic", "prb_projective", "prbvolpath", "volprim_rf_basic")
BESIDE = {"blender": "made by Blender's add-on in memory, never in a file"}


def run(program, *words):
    return subprocess.run([program, *words], capture_output=True, text=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("-i", "--importon", default=os.path.join(root, "build/cli/importon"))
    parser.add_argument("--keep", help="folder for the scenes")
    parser.add_argument("names", nargs="*")
    args = parser.parse_args()
    plugins = {f[:-3] for f in os.listdir(os.path.join(os.path.dirname(mi.__file__), "plugins")) if f.endswith(".so")}
    mi.set_variant("scalar_rgb")
    bad = 0
    with tempfile.TemporaryDirectory() as temporary:
        folder = args.keep or temporary
        made = cases(Files(folder))
        for name in sorted(plugins - made.keys() - BESIDE.keys()):
            print("%-18s no scene here" % name)
            bad += 1
        for name, (concept, what) in sorted(made.items(), key=lambda c: (c[1][0], c[0])):
            if args.names and name not in args.names:
                continue
            mode, path = MODE.get(name, "rgb"), os.path.join(folder, name + ".xml")
            try:
                mi.set_variant(VARIANT.get(name, "scalar_" + mode))
                config = mi.parser.ParserConfig(mi.variant())
                if what["integrator"]["type"] in PYTHON:  # of which the writer does not know what they are
                    what["integrator"]["type"] = "path"
                text = mi.parser.write_string(mi.parser.parse_dict(config, what))
                if name in PYTHON:
                    text = text.replace('<integrator type="path"', '<integrator type="%s"' % name)
            except (RuntimeError, TypeError, ValueError) as e:
                print("%-10s %-18s Mitsuba does not write it: %s" % (concept, name, str(e).replace("\n", " ")[:150]))
                continue
            with open(path, "w") as file:
                file.write(text)
            try:
                mi.load_file(path)
                peer = "loads"
            except (RuntimeError, ValueError) as e:
                peer = "Mitsuba: " + str(e).replace("\n", " ")[-110:]
            info = run(args.importon, "info", "-m", mode, path)
            out = os.path.join(folder, name + ".exr")
            render = run(args.importon, "render", "-q", "-m", mode, "--spp", "4", "--no-preview", path, "-o", out)
            lenient = run(args.importon, "render", "--lenient", "-m", mode, "--spp", "4", "--no-preview", path, "-o", out)
            lost = [line[len("without: "):].replace(folder + "/", "") for line in info.stdout.splitlines() if line.startswith("without: ")]
            if info.returncode == 0 and render.returncode == 0:
                verdict = "renders" + "".join("; " + w.split("warning: ")[-1].replace(folder + "/", "") for w in render.stderr.splitlines() if "warning" in w)
            elif lost and lenient.returncode == 0:
                verdict = "without: " + "; ".join(lost)
            else:
                verdict = "FAULT info %d render %d lenient %d: %s" % (info.returncode, render.returncode, lenient.returncode,
                                                                     (lenient.stderr or render.stderr or info.stderr).strip().splitlines()[-1].replace(folder + "/", ""))
                bad += 1
            print("%-10s %-18s %s%s" % (concept, name, verdict, "" if peer == "loads" else "  [%s]" % peer), flush=True)
    print("%d faults" % bad)
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
