# SPDX-License-Identifier: Apache-2.0
"""The smoke of docs/media.md 9, found again in its 16 pictures by importon and by Mitsuba 3
(prbvolpath, llvm_ad_rgb) in one run: processor seconds of one thread, and the error of the density.

    python3 bench/peers/smoke.py [-b BUILD] [-n N] [--spp N] [--rates R,R,...]

importon makes the pictures and fits them as that section has it. Mitsuba then has Adam (mi.ad) on the
same pictures, start, loss, smoothing, levels of the grid and samples, with each of the learning rates, once
with as many iterations and once with as many as importon's time suffices for; densities stay above 1e-6.
Compiling its kernels (a first gradient of each level) is not counted. The error is the root mean square over
all voxels, divided by that of the density. Skips (77) without mitsuba.
"""
import argparse
import os
import resource
import subprocess
import tempfile
import time

import needed

dr, mi, np, ndimage = needed.modules("drjit", "mitsuba", "numpy", "scipy.ndimage")
zoom = ndimage.zoom

here = os.path.dirname(os.path.abspath(__file__))
root = os.path.dirname(os.path.dirname(here))
SCENE = os.path.join(root, "scenes/smoke.xml")
VIEWS, CELLS, LEVELS, SMOOTH, FLOOR = 16, 64, 4, 1e-3, 1e-6
KEY = "smoke.sigma_t.data"


def children():
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def volume_read(path):
    """[z][y][x]"""
    with open(path, "rb") as file:
        data = file.read()
    nx, ny, nz, channels = np.frombuffer(data, "<i4", 4, 8)
    return np.frombuffer(data, "<f4", nx * ny * nz * channels, 48).reshape(nz, ny, nx)


def importon(program, folder, truth, a):
    """Seconds and density of importon's fit to the pictures that it makes."""
    scene = [SCENE, "-D", "density=" + truth]
    targets = []
    for k in range(VIEWS):
        view = "%s/view%d.exr" % (folder, k)
        subprocess.run([program, "render", *scene, "--sensor", str(k), "--spp", "128", "--seed", str(k + 1),
                        "-q", "--no-preview", "-o", view], check=True)
        targets += ["--target", view]
    start = children()
    subprocess.run([program, "fit", *scene, *targets, "-t", "1", "-p", "density.data", "--set", "density.data=1",
                    "--levels", str(LEVELS), "--lr", "0.2", "-n", str(a.iterations), "--spp", str(a.spp),
                    "--smooth", "density.data=%g" % SMOOTH, "--no-intervals", "-q", "-o", folder + "/found"],
                   check=True, stdout=subprocess.DEVNULL)
    return children() - start, volume_read(folder + "/found/density.data.vol")


class Peer:
    def __init__(self, folder, truth, spp):
        self.spp, self.seed = spp, 0
        self.scene = mi.load_file(SCENE, density=truth, optimize=False)
        self.params = mi.traverse(self.scene)
        self.integrator = mi.load_dict({"type": "prbvolpath", "max_depth": 16})
        self.views = [mi.TensorXf(mi.Bitmap("%s/view%d.exr" % (folder, k))) for k in range(VIEWS)]
        dr.set_thread_count(1)  # only now: with one thread Mitsuba waits for ever for a picture that it reads

    def step(self, optimizer, n):
        """One iteration on a grid of n^3 numbers. Their smoothing is that of the 64^3 cells, linear between."""
        for k in range(VIEWS):
            self.seed += 2
            image = mi.render(self.scene, self.params, sensor=k, integrator=self.integrator, spp=self.spp,
                              seed=self.seed, seed_grad=self.seed + 1)
            dr.backward(dr.sum(dr.square(image - self.views[k]), axis=None) / 2)
        x = optimizer[KEY]
        rough = 0
        for d in (x[1:] - x[:-1], x[:, 1:] - x[:, :-1], x[:, :, 1:] - x[:, :, :-1]):
            rough += dr.sum(dr.square(d), axis=None)
        dr.backward(rough * (SMOOTH / 2 * CELLS / n))
        optimizer.step()
        optimizer[KEY] = dr.maximum(optimizer[KEY], FLOOR)
        self.params.update(optimizer)
        dr.eval(self.params[KEY])
        dr.sync_thread()

    def fit(self, rate, iterations):
        """Seconds, density and iterations done."""
        density, seconds, done = np.ones((CELLS >> (LEVELS - 1),) * 3, np.float32), 0, 0
        for level in range(1, LEVELS + 1):
            n = CELLS >> (LEVELS - level)
            if n > len(density):
                density = zoom(density, n / len(density), order=1, mode="nearest", grid_mode=True)
            for compile_only in (True, False):
                optimizer = mi.ad.Adam(lr=rate)
                optimizer[KEY] = mi.TensorXf(density[..., None])
                self.params.update(optimizer)
                if compile_only:
                    self.step(optimizer, n)
            while done < iterations * level // LEVELS:
                start = time.process_time()
                self.step(optimizer, n)
                seconds += time.process_time() - start
                done += 1
            density = np.array(self.params[KEY])[..., 0]
        return seconds, density, done


def main():
    ap = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    ap.add_argument("-b", "--build", default=os.path.join(root, "build"))
    ap.add_argument("-n", "--iterations", type=int, default=120)
    ap.add_argument("--spp", type=int, default=4)
    ap.add_argument("--rates", default="0.2,0.1,0.05")
    a = ap.parse_args()
    mi.set_variant("llvm_ad_rgb")
    mi.set_log_level(mi.LogLevel.Error)
    with tempfile.TemporaryDirectory() as folder:
        file = folder + "/smoke.vol"
        subprocess.run([os.path.join(a.build, "examples/example_smoke"), str(CELLS), "7", file], check=True)
        truth = volume_read(file)

        def row(name, iterations, seconds, density):
            error = np.sqrt(((density - truth) ** 2).sum() / (truth ** 2).sum())
            print("%-24s %4d iterations  %6.1f s  error %.3f" % (name, iterations, seconds, error), flush=True)

        own, density = importon(os.path.join(a.build, "cli/importon"), folder, file, a)
        row("importon", a.iterations, own, density)
        peer = Peer(folder, file, a.spp)
        for rate in map(float, a.rates.split(",")):
            name = "Mitsuba, rate %g" % rate
            seconds, density, done = peer.fit(rate, a.iterations)
            row(name, done, seconds, density)
            seconds, density, done = peer.fit(rate, max(LEVELS, round(a.iterations * own / seconds)))
            row(name + ", equal time", done, seconds, density)


if __name__ == "__main__":
    main()
