# SPDX-License-Identifier: Apache-2.0
"""Photographs by another renderer, measured by importon: are its intervals right, does it name what is wrong?

    python3 bench/peers/photographs.py [-i IMPORTON] [--cases N] [--first K] [--kinds NAME,..] [--wrong lamp|material]
                                       [--spp N] [--spectral] [--estimated] [--keep FOLDER] [--json FILE]

Mitsuba 3 (llvm_ad_rgb; with --spectral llvm_ad_spectral, and importon's -m spectral) makes the light of each scene of photograph_cases.py along rays of a lens that distorts; here
a camera adds vignetting, exposure, white balance, the noise of light and of a sensor, a power of 1/gamma, clipping and
rounding to 8 bits. `importon measure` then has the shapes, the camera's calibrated curve, noise (unless --estimated) and coefficient of
distortion, and rough guesses of the numbers that are counted, and answers with intervals. With --wrong one thing in the scene is
wrong and held: the answer has to be "not explained", and that number among those that it names. --spp are importon's
samples of an evaluation (default 64). Skips (77) without mitsuba.
"""
import argparse
import json
import math
import os
import random
import subprocess
import tempfile
import time

import needed

mi, np = needed.modules("mitsuba", "numpy")

import photograph_cases

here = os.path.dirname(os.path.abspath(__file__))
root = os.path.dirname(os.path.dirname(here))
WIDTH, HEIGHT = 24, 20
FULL_WELL = 1000  # electrons at white: the noise of light
READ = 0.004  # of white: the noise of the sensor
PASS = 1024  # rays in each pixel of a pass


# ---- The lens and the camera -----------------------------------------------------------------

def frame(origin, target):
    """Columns: the camera's x (to the left), y (up), z (forward)."""
    z = np.subtract(target, origin)
    z = z / np.linalg.norm(z)
    x = np.cross((0, 1, 0), z)
    x = x / np.linalg.norm(x)
    return np.stack([x, np.cross(z, x), z], 1)


def rays(camera, k1, spp, rng):
    """Origins and directions of spp rays in each pixel, whose image points the lens moves by 1 + k1 r^2."""
    origin, target, fov = camera
    n = WIDTH * HEIGHT * spp
    pixel = np.repeat(np.arange(WIDTH * HEIGHT), spp)
    half = math.tan(math.radians(fov) / 2)
    x = ((pixel % WIDTH + rng.random(n)) / WIDTH * 2 - 1) * half
    y = ((pixel // WIDTH + rng.random(n)) / HEIGHT * 2 - 1) * half * HEIGHT / WIDTH
    u, v = x.copy(), y.copy()
    for _ in range(30):
        factor = 1 + k1 * (u * u + v * v)
        u, v = x / factor, y / factor
    d = np.stack([-u, -v, np.ones(n)], 1) @ frame(origin, target).T
    return np.broadcast_to(origin, (n, 3)), d / np.linalg.norm(d, axis=1)[:, None]


def light(scene, camera, k1, spp, seed):
    """[HEIGHT][WIDTH][3] mean radiance."""
    o, d = rays(camera, k1, spp, np.random.default_rng(seed))
    sampler = mi.load_dict({"type": "independent"})
    sampler.seed(seed, len(o))
    ray = mi.RayDifferential3f(mi.Point3f(*o.T.astype(np.float32)), mi.Vector3f(*d.T.astype(np.float32)))
    if mi.is_spectral:  # four wavelengths of a ray, a quarter of the distribution apart
        u = sampler.next_1d()
        ray.wavelengths, weight = mi.sample_rgb_spectrum(mi.Spectrum([u + .25 * k - mi.Float(u + .25 * k >= 1) for k in range(4)]))
        value = scene.integrator().sample(scene, sampler, ray)[0]
        value = mi.spectrum_to_srgb(value * weight, ray.wavelengths)
    else:
        value = scene.integrator().sample(scene, sampler, ray)[0]
    return np.array(value).T.reshape(HEIGHT, WIDTH, spp, 3).astype(float).mean(2)


def whole_light(scene, camera, k1, spp, seed):
    """As light, in passes that fit into memory."""
    passes = max(1, spp // PASS)
    return sum(light(scene, camera, k1, spp // passes, passes * seed + i) for i in range(passes)) / passes


def camera_numbers(rng, first):
    """What a photograph has besides light; the first one's exposure and balance are those of the scene."""
    return {"exposure": 1. if first else rng.uniform(.8, 1.3), "white_balance_red": 1. if first else rng.uniform(.9, 1.2),
            "white_balance_blue": 1. if first else rng.uniform(.9, 1.2), "vignetting_2": rng.uniform(-.3, -.1),
            "gamma": rng.uniform(2, 2.4), "k1": rng.uniform(-.12, .05)}


def expose(radiance, numbers, unit, rng):
    """Integers of a file of 8 bits."""
    x = (np.arange(WIDTH) + .5) / WIDTH * 2 - 1
    y = (np.arange(HEIGHT) + .5) / HEIGHT * 2 - 1
    r2 = (x[None, :] ** 2 * WIDTH ** 2 + y[:, None] ** 2 * HEIGHT ** 2) / (WIDTH ** 2 + HEIGHT ** 2)
    gain = unit * numbers["exposure"] * (1 + numbers["vignetting_2"] * r2[:, :, None])
    value = radiance * gain * np.array([numbers["white_balance_red"], 1, numbers["white_balance_blue"]])
    value = rng.poisson(np.maximum(value, 0) * FULL_WELL) / FULL_WELL + READ * rng.standard_normal(value.shape)
    return np.rint(255 * np.clip(value, 0, 1) ** (1 / numbers["gamma"])).astype(np.uint8)


# ---- Files -----------------------------------------------------------------------------------

def sensor_text(name, camera, numbers):
    o, t, fov = camera
    film = "".join('<float name="%s" value="%.9g"/>' % (k, numbers[k]) for k in numbers if k != "k1")
    return ('<sensor type="perspective" id="%s"><float name="fov" value="%g"/><float name="opencv_k1" value="%.9g"/><transform name="to_world">'
            '<lookat origin="%.9g,%.9g,%.9g" target="%.9g,%.9g,%.9g" up="0,1,0"/></transform><film type="hdrfilm"><integer name="width" '
            'value="%d"/><integer name="height" value="%d"/><rfilter type="box"/>%s</film></sensor>\n'
            % (name, fov, numbers["k1"], *o, *t, WIDTH, HEIGHT, film))


def files_write(folder, rng):
    """A floor of 6 x 6 tiles and a sky with a sun-lit side, which both renderers read."""
    tiles = bytes(rng.randrange(60, 200) for _ in range(108))
    with open(folder + "/tiles.ppm", "wb") as f:
        f.write(b"P6 6 6 255\n" + tiles)
    sky = np.array([[[.4 + .6 * max(0, math.cos(.39 * x)) * (1 - y / 8)] * 3 for x in range(16)] for y in range(8)]) * [1, .9, .8]
    with open(folder + "/sky.pfm", "wb") as f:
        f.write(b"PF\n16 8\n-1\n" + sky[::-1].astype("<f4").tobytes())


# ---- One case --------------------------------------------------------------------------------

def poses(case):
    """Where a camera is, away from its guess: translation and rotation vector."""
    out = []
    for (o, t, _), (g, s, _) in zip(case.cameras, case.guessed):
        turn = frame(o, t) @ frame(g, s).T
        angle = math.acos(min(1, max(-1, (np.trace(turn) - 1) / 2)))
        axis = np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]])
        length = np.linalg.norm(axis)
        out.append(list(np.subtract(o, g)) + list(axis / length * angle if length > 0 else axis))
    return out


def truth_of(case, cameras, names):
    truth = dict(case.truth)
    for name, numbers, pose in zip(names, cameras, poses(case)):
        truth.update({"%s.%s.value" % (name, k): v for k, v in numbers.items()})
        truth[name + ".pose"] = pose
    if "lamp_x" in truth:
        truth["lamp_shape.pose"] = [truth["lamp_x"] - case.guess["lamp_x"], 0, truth["lamp_z"] - case.guess["lamp_z"], 0, 0, 0]
    return truth


def one_case(kind, seed, a, folder):
    rng, names = random.Random("%s %d" % (kind, seed)), ["left", "right"]
    case = photograph_cases.KINDS[kind](rng, a.wrong)
    cameras = [camera_numbers(rng, k == 0) for k in range(2)]
    files_write(folder, rng)
    with open(folder + "/truth.xml", "w") as f:
        f.write('<scene version="3.0.0">%s</scene>' % case.text(case.truth))
    scene = mi.load_file(folder + "/truth.xml", optimize=False)
    pictures = [whole_light(scene, c, n["k1"], a.rays, 100 * seed + k + 1) for k, (c, n) in enumerate(zip(case.cameras, cameras))]
    unit = case.bright / np.percentile(pictures[0], 90)
    noise = np.random.default_rng(seed)
    for name, numbers, picture in zip(names, cameras, pictures):
        with open("%s/%s.ppm" % (folder, name), "wb") as f:
            f.write(b"P6 %d %d 255\n" % (WIDTH, HEIGHT) + expose(picture, numbers, unit, noise).tobytes())
        numbers["exposure"] *= unit
    guesses = [{"exposure": c["exposure"] if k == 0 else photograph_cases.off(rng, c["exposure"], .3), "white_balance_red": 1, "white_balance_blue": 1,
                "vignetting_2": 0, "gamma": c["gamma"], "k1": c["k1"]} for k, c in enumerate(cameras)]
    with open(folder + "/guess.xml", "w") as f:
        f.write('<scene version="3.0.0">%s%s</scene>' % ("".join(map(sensor_text, names, case.guessed, guesses)), case.text(case.guess)))
    command = [a.importon, "measure", folder + "/guess.xml", *["%s/%s.ppm" % (folder, n) for n in names], "-q", "--json", "--spp", str(a.spp),
               "--seed", str(seed + 1), "-t", str(a.threads)]
    command += ["-m", "spectral"] if a.spectral else []
    command += [] if a.estimated else ["--noise", "read=%g,shot=%g" % (READ, 1 / FULL_WELL)]
    for word, items in (("--hold", case.hold + ["left.white_balance*", "left.exposure.*", "*.gamma.*"]), ("-p", case.params)):
        for item in items:
            command += [word, item]
    start = time.time()
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode:
        return {"kind": kind, "seed": seed, "failed": done.stderr.strip()[-300:], "command": " ".join(command)}
    return verdict(case, kind, seed, json.loads(done.stdout), truth_of(case, cameras, names), time.time() - start, a.wrong)


def verdict(case, kind, seed, answer, truth, seconds, wrong):
    rows, out = answer["fit"]["params"], []
    for row in rows:
        name, element = (row["name"][:-1].split("[") + [0])[:2] if row["name"].endswith("]") else (row["name"], 0)
        value = truth[name]
        value = value[int(element)] if isinstance(value, (tuple, list)) else value
        if not row.get("se") or row.get("lo95") is None:  # 0: it is held
            continue
        out.append({"name": row["name"], "truth": float(value), "value": row["value"], "se": row["se"], "inside": bool(row["lo95"] <= value <= row["hi95"])})
    named = [line for line in answer["decisions"] if line.startswith("not measured, and may be wrong")]
    return {"kind": kind, "seed": seed, "explained": answer["explained"], "numbers": out, "seconds": seconds, "lines": answer["decisions"],
            "named": bool(wrong) and any(case.mistakes[wrong] in line for line in named)}


def main():
    p = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    p.add_argument("-i", "--importon", default=os.path.join(root, "build/cli/importon"))
    p.add_argument("--cases", type=int, default=10)
    p.add_argument("--first", type=int, default=0)
    p.add_argument("--kinds", default=",".join(photograph_cases.KINDS))
    p.add_argument("--wrong", choices=["lamp", "material"])
    p.add_argument("--spp", type=int, default=64, help="of importon")
    p.add_argument("--rays", type=int, default=8192, help="of Mitsuba, in each pixel: its own noise is to be small beside the camera's")
    p.add_argument("--spectral", action="store_true")
    p.add_argument("--estimated", action="store_true", help="the camera's noise is not given, but estimated")
    p.add_argument("-t", "--threads", type=int, default=2)
    p.add_argument("--keep", help="folder in which the files of each case stay")
    p.add_argument("--json")
    p.add_argument("-v", "--verbose", action="store_true")
    a = p.parse_args()
    mi.set_variant("llvm_ad_spectral" if a.spectral else "llvm_ad_rgb")
    results = []
    for kind in a.kinds.split(","):
        for seed in range(a.first, a.first + a.cases):
            with tempfile.TemporaryDirectory() as scratch:
                folder = "%s/%s-%d%s" % (a.keep or scratch, kind, seed, "-" + a.wrong if a.wrong else "")
                os.makedirs(folder, exist_ok=True)
                r = one_case(kind, seed, a, folder)
            results.append(r)
            if "failed" in r:
                print("%s %d: failed: %s\n%s" % (kind, seed, r["failed"], r["command"]), flush=True)
                continue
            outside = [x for x in r["numbers"] if not x["inside"]]
            print("%s %d: %s, %d of %d inside, %.0f s%s%s" % (kind, seed, "explained" if r["explained"] else "not explained",
                  len(r["numbers"]) - len(outside), len(r["numbers"]), r["seconds"], ", named" if r["named"] else "",
                  "".join("; %s %.4g, %.4g +- %.2g" % (x["name"], x["truth"], x["value"], x["se"]) for x in outside[:6])), flush=True)
            if a.verbose:
                print("\n".join("    " + line for line in r["lines"]), flush=True)
    if a.json:
        with open(a.json, "w") as f:
            json.dump(results, f)


main()
