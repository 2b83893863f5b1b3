# SPDX-License-Identifier: Apache-2.0
"""Derivatives with respect to extinction where Mitsuba 3's prbvolpath goes wrong, beside
importon's and the truth (docs/media.md, 11).

    python3 bench/peers/media_gradients.py [-i IMPORTON] [--spp N] [--runs N]

A cube of side 1 before an orthographic camera of 16 x 16 pixels, under uniform light of
radiance 1: without extinction, nearly without, in three colours of very different
extinction, and with the camera inside. The error of Mitsuba's numbers is the spread of RUNS
runs. Skips (77) without mitsuba.
"""
import argparse
import math
import os
import subprocess
import tempfile

import needed

dr, mi, np = needed.modules("drjit", "mitsuba", "numpy")

here = os.path.dirname(os.path.abspath(__file__))
SCENE = """<scene version="3.0.0"><default name="integrator" value="volpath"/>
<integrator type="$integrator"><integer name="max_depth" value="64"/></integrator>
<medium type="homogeneous" id="fog">%s<float name="albedo" value="%g"/></medium>
<shape type="cube"><bsdf type="null"/><ref id="fog" name="interior"/>
<transform name="to_world"><scale value="0.5"/></transform></shape>
<emitter type="constant"><float name="radiance" value="1"/></emitter>
<sensor type="orthographic"><transform name="to_world"><scale x="0.4" y="0.4" z="1"/>
<lookat origin="0,0,%g" target="0,0,1" up="0,1,0"/></transform>
<float name="near_clip" value="0.0001"/>%s
<film type="hdrfilm"><integer name="width" value="16"/><integer name="height" value="16"/>
<rfilter type="box"/></film></sensor></scene>"""
GREY = '<float name="sigma_t" value="%g"/>'
RGB = '<rgb name="sigma_t" value="%s"/><float name="scale" value="10"/>'
INSIDE = '<ref id="fog"/>'
# name, extinction, albedo, where the camera is, its medium, true picture and derivative
CASES = [
    ("sigma_t = 0", GREY % 0, 0.9, -3, "", 1, -0.1),
    ("sigma_t = .001", GREY % 0.001, 0.9, -3, "", None, None),
    ("camera inside, albedo 0", GREY % 1, 0, -0.5, INSIDE, math.exp(-1), -math.exp(-1)),
    ("sigma_t = 10 (.2, .6, .9)", RGB % "0.2,0.6,0.9", 0.9, -3, "", None, None),
]


def ours(importon, path, spp):
    """Mean of the picture, and per number (derivative, error)."""
    text = subprocess.run(
        [importon, "gradient", path, "-p", "fog.sigma_t*", "--spp", str(spp), "--seed", "1"],
        check=True, capture_output=True, text=True).stdout
    rows = [line.split() for line in text.splitlines()]
    mean = next(float(r[1]) for r in rows if r and r[0] == "mean")
    return mean, [(float(r[2]), float(r[3])) for r in rows if r and r[0].startswith("fog.")]


def theirs(path, spp, runs):
    scene = mi.load_file(path, integrator="prbvolpath")
    params = mi.traverse(scene)
    key = "fog.sigma_t.value.value"
    if key not in params:
        key = next(k for k in params.keys() if "sigma_t" in k)
    pictures, values = [], []
    for seed in range(runs):
        dr.enable_grad(params[key])
        params.update()
        image = mi.render(scene, params, spp=spp, seed=seed, seed_grad=seed + 1000)
        pictures.append(float(np.array(image).mean()))
        dr.backward(dr.mean(image, axis=None))
        values.append(np.array(dr.grad(params[key])).ravel().astype(float))
        dr.disable_grad(params[key])
    values = np.array(values)
    return np.mean(pictures), values.mean(axis=0), values.std(axis=0, ddof=1)


def forward(path):
    scene = mi.load_file(path, integrator="prbvolpath")
    params = mi.traverse(scene)
    key = next(k for k in params.keys() if "sigma_t" in k)
    dr.enable_grad(params[key])
    params.update()
    image = mi.render(scene, params, spp=4)
    try:
        dr.forward(params[key])
        return "%g" % float(np.array(dr.grad(image)).mean())
    except Exception as e:  # what it raises is of Dr.Jit's
        return "refused: %s" % str(e).splitlines()[0]


def main():
    ap = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    ap.add_argument("-i", "--importon",
                    default=os.path.join(here, "../../build/cli/importon"))
    ap.add_argument("--spp", type=int, default=4096)
    ap.add_argument("--runs", type=int, default=8)
    a = ap.parse_args()
    mi.set_variant("llvm_ad_rgb")
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "cube.xml")
        for name, sigma, albedo, z, medium, picture, derivative in CASES:
            with open(path, "w") as f:
                f.write(SCENE % (sigma, albedo, z, medium))
            mean, rows = ours(a.importon, path, a.spp)
            other, values, spread = theirs(path, a.spp, a.runs)
            print("%s%s" % (name, "" if picture is None else
                            ": truth %.5f, derivative %.5f" % (picture, derivative)))
            print("  picture: importon %.5f, Mitsuba %.5f" % (mean, other))
            for k, (g, se) in enumerate(rows):
                if k >= len(values):
                    break
                print("  derivative: importon %.5f +- %.5f, Mitsuba %.5f +- %.5f "
                      "(error of a run; variance %.3g of importon's)"
                      % (g, se, values[k], spread[k], (spread[k] / se) ** 2 if se else 0))
        print("forward mode: Mitsuba %s" % forward(path))


if __name__ == "__main__":
    main()
