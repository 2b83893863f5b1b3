# SPDX-License-Identifier: Apache-2.0
"""Media in importon and Mitsuba 3 (llvm_ad_rgb) in one run: pictures, and gradients of the
picture's mean with respect to every number of an extinction.

    python3 bench/peers/media.py [-b MEDIA] [-i IMPORTON] [--repeats N] [--spp N] [--cells N]
                                 [--runs N] [--agree SPP] [--only NAME]

MEDIA is bench/media, which writes the scenes and measures importon on one thread;
Mitsuba's volpath and prbvolpath follow on one thread, kernels compiled beforehand. Seconds
are the processor's. The variance is that of the gradient, summed over its numbers: from
importon's standard errors, and from the spread of Mitsuba's N runs with other seeds. So is
the error of the median pixel's green, from which the time to 1 % follows. Segments are
counted by importon; walks have the same length in both. Memory is the peak of a process
that loads the scene and makes one gradient.

With --agree pictures of so many samples are compared as by zcompare.py. NAME is box, plume or
sky.
Skips (77) without mitsuba.
"""
import argparse
import os
import re
import subprocess
import sys
import tempfile
import time

import needed

dr, mi, np = needed.modules("drjit", "mitsuba", "numpy")
import zcompare

here = os.path.dirname(os.path.abspath(__file__))
NUMBERS = {"box": ("smoke.sigma_t.value", "smoke.sigma_t.value.value"),
           "plume": ("density.data", "smoke.sigma_t.data"),
           "sky": ("density.data", "air.sigma_t.data")}


def peak(command):
    """MiB of a process, by looking at it again and again: what wait4 tells has its parent's."""
    process, most = subprocess.Popen(command, stdout=subprocess.DEVNULL), 0
    while process.poll() is None:
        with open("/proc/%d/status" % process.pid) as file:
            found = re.search(r"VmHWM:\s+(\d+)", file.read())
        most = max(most, int(found.group(1)) if found else 0)
        time.sleep(.005)
    if process.returncode:
        sys.exit("%s failed" % " ".join(command))
    return most / 1024


def noise(images):
    """The median pixel's relative error, of those that are noisy (green)."""
    green = np.array(images, float)[..., 1]
    mean, error = green.mean(0), green.std(0, ddof=1)
    noisy = error > 1e-6 * mean
    return np.median(error[noisy] / mean[noisy])


def mitsuba_picture(path, spp, runs):
    scene = mi.load_file(path, integrator="volpath")
    seconds, images = [], []
    for seed in range(runs + 1):  # the first compiles
        start = time.process_time()
        image = mi.render(scene, spp=spp, seed=seed)
        dr.eval(image)
        dr.sync_thread()
        seconds.append(time.process_time() - start)
        images.append(np.array(image))
    return min(seconds[1:]), noise(images[1:])


def mitsuba_gradient(path, key, spp, runs):
    scene = mi.load_file(path, integrator="prbvolpath")
    params = mi.traverse(scene)
    gradient, values = [], []
    for seed in range(runs + 1):  # the first compiles
        dr.enable_grad(params[key])
        params.update()
        start = time.process_time()
        image = mi.render(scene, params, spp=spp, seed=seed + 100, seed_grad=seed + 1000)
        dr.backward(dr.mean(image, axis=None))
        values.append(np.array(dr.grad(params[key])).ravel().astype(float))
        gradient.append(time.process_time() - start)
        dr.disable_grad(params[key])
    if runs < 2:
        return gradient[0], 0
    return min(gradient[1:]), np.array(values[1:]).var(axis=0, ddof=1).sum()


def agree(program, path, spp):
    case = zcompare.Case("media", [path])
    with tempfile.TemporaryDirectory() as folder:
        mean, se, _ = zcompare.importon_render(program, case, spp, 1, os.path.join(folder, "x.exr"))
    batches, n, _ = zcompare.mitsuba_render(case, spp)
    rows = zcompare.compare(mean, se, batches, False).values()
    print("    %s, %d samples: largest z of a mean %.2f, pixels failing %.4f, |z| > 2 %.4f"
          % ("agrees" if all(r["agree"] for r in rows) else "DIFFERS", n,
             max((r["mean_z"] for r in rows), key=abs), max(r["failed"] for r in rows),
             max(r["over2"] for r in rows)), flush=True)


def main():
    ap = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    ap.add_argument("-b", "--bench", default=os.path.join(here, "../../build/bench/media"))
    ap.add_argument("-i", "--importon", default=os.path.join(here, "../../build/cli/importon"))
    ap.add_argument("--repeats", type=int, default=3)
    ap.add_argument("--spp", type=int, default=32)
    ap.add_argument("--cells", type=int, default=64)
    ap.add_argument("--runs", type=int, default=12)
    ap.add_argument("--agree", type=int, default=0)
    ap.add_argument("--only", choices=sorted(NUMBERS))
    ap.add_argument("--one", nargs=2, help=argparse.SUPPRESS)  # a gradient, for its memory
    a = ap.parse_args()
    mi.set_variant("llvm_ad_rgb")
    dr.set_thread_count(1)
    if a.one:
        mitsuba_gradient(*a.one, a.spp, 0)
        return
    with tempfile.TemporaryDirectory() as folder:
        text = subprocess.run([a.bench, folder, str(a.repeats), str(a.spp), str(a.cells)],
                              check=True, capture_output=True, text=True).stdout
        sys.stdout.write(text)
        row = (r"^(\w+) picture (\S+) gradient (\S+) variance (\S+) noise (\S+) "
               r"segments (\S+)$")
        for name, *numbers in re.findall(row, text, re.MULTILINE):
            if a.only not in (None, name):
                continue
            picture, gradient, variance, error, segments = [float(x) for x in numbers]
            path = "%s/%s.xml" % (folder, name)
            samples = 128 * 128 * a.spp

            def line(who, seconds, its_noise):
                print("%s, %s: picture %.4g s, %.3g segments a second, 1 %% in %.3g s"
                      % (name, who, seconds, segments * samples / seconds,
                         seconds * (its_noise / .01) ** 2), flush=True)

            line("importon", picture, error)
            peer, its_noise = mitsuba_picture(path, a.spp, 16)
            line("Mitsuba", peer, its_noise)
            seconds, spread = mitsuba_gradient(path, NUMBERS[name][1], a.spp, a.runs)
            print("%s, Mitsuba: gradient %.4g s (%.2f pictures), %s"
                  % (name, seconds, seconds / peer,
                     "every derivative 0, without a word" if spread == 0 else
                     "variance %.3g; variance x time, importon/Mitsuba %.3g"
                     % (spread, gradient * variance / (seconds * spread))))
            own = peak([a.importon, "gradient", path, "-p", NUMBERS[name][0], "--spp", str(a.spp),
                        "-t", "1", "-q", "-o", folder + "/gradient"])
            other = peak([sys.executable, __file__, "--spp", str(a.spp), "--one", path,
                          NUMBERS[name][1]])
            print("%s: memory of a gradient, importon %.0f MiB, Mitsuba %.0f MiB"
                  % (name, own, other), flush=True)
            if a.agree:
                dr.set_thread_count(2)  # with one, Mitsuba waits for ever for a picture that it reads
                agree(a.importon, path, a.agree)
                dr.set_thread_count(1)


if __name__ == "__main__":
    main()
