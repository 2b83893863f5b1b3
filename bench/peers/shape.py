# SPDX-License-Identifier: Apache-2.0
"""The shape of docs/do/shape.md, looked for by importon and by Mitsuba 3 (mi.ad.LargeSteps) in the same
pictures: processor seconds, and the distance of what each finds from the truth.

    python3 bench/peers/shape.py [-b BUILD] [--frequency 22] [--views 16] [--res 64] [--spp 16] [-n N]
                                 [--rates R,R,...] [--integrators NAME,...] [--variant NAME] [--skip-importon]

Mitsuba has the sum of squares as its loss, Adam with uniform steps and, with each of the learning rates, as
many iterations; kernels are compiled before (a first gradient of each camera is not counted). Skips (77)
without mitsuba."""
import argparse
import os
import resource
import subprocess
import sys
import tempfile
import time

import needed

dr, mi, np = needed.modules("drjit", "mitsuba", "numpy")

here = os.path.dirname(os.path.abspath(__file__))
root = os.path.dirname(os.path.dirname(here))
sys.path.insert(0, os.path.join(root, "scenes"))
sys.dont_write_bytecode = True
import shape_distance as far  # noqa: E402

KEY = "body.vertex_positions"


def seconds(who):
    used = resource.getrusage(who)
    return used.ru_utime + used.ru_stime


def distance(mesh, truth):
    import random
    one, other, chance = far.Surface(*mesh), far.Surface(*truth), random.Random(1)
    d = [[b.distance(p) for p in a.points(500, chance)] for a, b in ((one, other), (other, one))]
    return sum(map(sum, d)) / 1000, max(map(max, d))


def by_importon(a, folder, importon, targets, start, truth):
    before, clock = seconds(resource.RUSAGE_CHILDREN), time.time()
    command = [importon, "fit", folder + "/shape.xml", "-p", KEY, "--spp", str(a.spp), "-n", str(a.n), "-q",
               "--no-intervals", "-o", folder + "/found", "--overwrite"]
    for t in targets:
        command += ["-T", t]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    used, wall = seconds(resource.RUSAGE_CHILDREN) - before, time.time() - clock
    mesh = (far.read_found(folder + "/found/textures.txt", len(start[0])), start[1])
    print("importon                             %6.1f s of processors, %5.1f s, mean %.4f, largest %.3f" %
          ((used, wall) + distance(mesh, truth)), flush=True)


def by_mitsuba(a, folder, name, rate, pictures, truth):
    scene = mi.load_file(folder + "/shape.xml")
    integrator = mi.load_dict({"type": name})
    params = mi.traverse(scene)
    key = [k for k in params.keys() if k.endswith(KEY)][0]
    faces = key.replace("vertex_positions", "faces")
    large = mi.ad.LargeSteps(params[key], params[faces], a.mitsuba_lambda)
    opt = mi.ad.Adam(lr=rate, uniform=True)
    opt["u"] = large.to_differential(params[key])

    def sweep(seed):
        for k, picture in enumerate(pictures):
            image = mi.render(scene, params, sensor=scene.sensors()[k], integrator=integrator, spp=a.spp,
                              seed=seed * len(pictures) + k)
            dr.backward(dr.sum((image - picture) ** 2, axis=None))

    params[key] = large.from_differential(opt["u"])
    params.update()
    sweep(1 << 20)
    dr.sync_thread()
    opt["u"] = dr.detach(opt["u"])
    dr.enable_grad(opt["u"])
    before, clock = seconds(resource.RUSAGE_SELF), time.time()
    for i in range(a.n):
        params[key] = large.from_differential(opt["u"])
        params.update()
        sweep(i)
        opt.step()
    dr.sync_thread()
    used, wall = seconds(resource.RUSAGE_SELF) - before, time.time() - clock
    params[key] = large.from_differential(opt["u"])
    v = np.array(params[key]).reshape(-1, 3)
    t = np.array(params[faces]).reshape(-1, 3)
    mesh = ([tuple(map(float, p)) for p in v], [list(map(int, f)) for f in t])
    found = distance(mesh, truth) if np.isfinite(v).all() else (np.nan, np.nan)
    print("Mitsuba %-20s lr %-6g %6.1f s of processors, %5.1f s, mean %.4f, largest %.3f" %
          ((name, rate, used, wall) + found), flush=True)


def main():
    p = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    p.add_argument("-b", "--build", default=os.path.join(root, "build"))
    for name, value in (("frequency", 22), ("views", 16), ("res", 64), ("spp", 16)):
        p.add_argument("--" + name, type=int, default=value)
    p.add_argument("-n", type=int, default=60)
    p.add_argument("--rates", default="0.02,0.05,0.1")
    p.add_argument("--integrators", default="direct_projective,prb_projective")
    p.add_argument("--mitsuba-lambda", type=float, default=25)
    p.add_argument("--variant", default="llvm_ad_rgb")
    p.add_argument("--skip-importon", action="store_true")
    a = p.parse_args()
    mi.set_variant(a.variant)
    importon = os.path.join(a.build, "cli/importon")
    with tempfile.TemporaryDirectory() as folder:
        subprocess.run([sys.executable, root + "/scenes/make_shape.py", folder, "--views", str(a.views), "--frequency",
                        str(a.frequency), "--res", str(a.res)], check=True)
        targets = []
        for k in range(a.views):
            targets.append("%s/target%d.exr" % (folder, k))
            subprocess.run([importon, "render", folder + "/truth.xml", "-s", str(k), "--spp", "512", "--seed", "1", "-q",
                            "-o", targets[-1]], check=True)
        start, truth = far.read_obj(folder + "/start.obj"), far.read_obj(folder + "/truth.obj")
        print("start: mean %.4f, largest %.3f" % distance(start, truth), flush=True)
        if not a.skip_importon:
            by_importon(a, folder, importon, targets, start, truth)
        pictures = [mi.TensorXf(mi.Bitmap(t))[:, :, :3] for t in targets]
        for name in a.integrators.split(","):
            for rate in map(float, a.rates.split(",")):
                by_mitsuba(a, folder, name, rate, pictures, truth)


if __name__ == "__main__":
    main()
