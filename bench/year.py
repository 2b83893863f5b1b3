# SPDX-License-Identifier: Apache-2.0
"""A year of daylight beside the reading of one of its hours: processor time; and errors as stated and as seen.

    python3 bench/year.py [-b IMPORTON] [--spp N ...] [--repeats N] [--seeds N]

The office of scenes/daylit.xml under the weather of scenes/make_weather.py, 40 points, one thread. The hour has Perez'
sky and the sun, as `read --grid` reads it. Times are the least of the repeats, which take turns, start included.
With --seeds, as many runs at each number of samples are compared with their mean and with 131,072 samples.
"""
import argparse
import json
import math
import os
import resource
import subprocess
import sys
import tempfile

root = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
SKY = '<emitter type="ciesky" id="sky"> <float name="illuminance" value="$illuminance"/> </emitter>'
HOUR = ('<emitter type="perezsky"><float name="diffuse" value="150"/><float name="direct" value="500"/>'
        '<vector name="sun_direction" x=".6" y=".2" z=".7"/></emitter>'
        '<emitter type="sun"><float name="radiance" value="7e8"/><vector name="direction" x="-.6" y="-.2" z="-.7"/></emitter>')


def timed(command):
    """Output and processor seconds of a program."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    ran = subprocess.run(command, capture_output=True, text=True, check=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return ran.stdout, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def main():
    ap = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    ap.add_argument("-b", "--importon", default=os.path.join(root, "build/cli/importon"))
    ap.add_argument("--spp", type=int, nargs="+", default=[1024, 4096, 16384])
    ap.add_argument("--repeats", type=int, default=5)
    ap.add_argument("--seeds", type=int, default=0)
    a = ap.parse_args()
    year = os.path.join(root, "scenes/daylit.xml")
    with tempfile.TemporaryDirectory() as folder:
        hour, weather = os.path.join(folder, "hour.xml"), os.path.join(folder, "town.epw")
        with open(year, encoding="utf-8") as f:
            text = f.read()
        assert SKY in text
        with open(hour, "w", encoding="utf-8") as f:
            f.write(text.replace(SKY, HOUR))
        with open(weather, "w", encoding="utf-8") as f:
            subprocess.run([sys.executable, os.path.join(root, "scenes/make_weather.py"), "--seed", "1"], stdout=f, check=True)

        def command(scene, spp, seed, *more):
            return [a.importon, "read", scene, "-m", "mono", "-t", "1", "-D", "spp=%d" % spp, "--seed", str(seed), *more]

        def average(spp, seed):
            return json.loads(timed(command(year, spp, seed, "--year", weather, "--json"))[0])["years"][0]["average"]

        for spp in a.spp:
            both = [(timed(command(year, spp, 0, "--year", weather))[1], timed(command(hour, spp, 0, "--grid"))[1])
                    for _ in range(a.repeats)]
            one, other = (min(column) for column in zip(*both))
            print("%6d samples: the year %.3f s, the hour %.3f s, %.2f times" % (spp, one, other, one / other), flush=True)
        truth = [average(131072, 1000 + k) for k in range(4)] if a.seeds else []
        for spp in a.spp if a.seeds else []:
            runs = [average(spp, k) for k in range(a.seeds)]
            for number in ("autonomy", "continuous", "mean", "exposure"):
                true = sum(t[number]["value"] for t in truth) / len(truth)
                off = [r[number]["value"] - true for r in runs]
                said = math.sqrt(sum(r[number]["se"] ** 2 for r in runs) / len(runs))
                seen = math.sqrt(sum(x * x for x in off) / len(runs))
                held = sum(abs(x) <= 2.131 * r[number]["se"] for x, r in zip(off, runs)) / len(runs)
                print("%6d samples, %-10s bias %+.2g, error %.2g, stated %.2g: %.2f times; %.0f %% of intervals hold"
                      % (spp, number, sum(off) / len(off), seen, said, said / seen, 100 * held), flush=True)


if __name__ == "__main__":
    main()
