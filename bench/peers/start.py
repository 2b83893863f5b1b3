# SPDX-License-Identifier: Apache-2.0
"""The first picture of spectral scenes, beside Mitsuba 3: loading, and one sample of each pixel of a small film.

    python3 bench/peers/start.py [-i IMPORTON] [--repeats N] [--side N] FOLDER FILE...

Processor seconds, the least of N repeats (5), in which both programs take turns, on one thread. Ours are those of the
whole process (`importon render -m spectral --spp 1`); Mitsuba's (scalar_spectral, which compiles nothing) those from load_file
to the picture, in a process of its own: the interpreter and the import are left out; one that hangs (on one thread some
scenes do) is ended after a minute. FOLDER, in which the files and all
that they name are, is copied (without folders called refs), and width and height of its films are made N pixels (16). Lines whose ratio is above 2 are marked, and their number is the last line.
"""
import argparse
import os
import re
import resource
import shutil
import subprocess
import sys
import tempfile

import needed

needed.modules("mitsuba")

root = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
TOO_MUCH = 2

PEER = """
import sys, time, mitsuba as mi, drjit as dr
mi.set_variant("scalar_spectral")
mi.set_log_level(mi.LogLevel.Error)
dr.set_thread_count(1)
start = time.process_time()
mi.render(mi.load_file(sys.argv[1]), spp=1)
print(time.process_time() - start)
"""


def shrink(folder, side):
    """Films of the copied scenes become side x side."""
    for at, _, names in os.walk(folder):
        os.chmod(at, 0o755)  # what was copied may not have been writable
        for name in names:
            if not name.endswith(".xml"):
                continue
            path = os.path.join(at, name)
            with open(path, encoding="utf-8") as f:
                text = f.read()
            with open(path, "w", encoding="utf-8") as f:
                f.write(re.sub(r'(<integer name="(?:width|height)" value=)"[^"]*"', r'\1"%d"' % side, text))


def ours(importon, path, out):
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run([importon, "render", path, "-m", "spectral", "--spp", "1", "--threads", "1", "-q", "--no-preview", "--overwrite",
                    "-o", out], check=True, capture_output=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime - before.ru_utime + after.ru_stime - before.ru_stime


def theirs(path):
    return float(subprocess.run([sys.executable, "-c", PEER, path], check=True, capture_output=True, text=True,
                                timeout=60).stdout.split()[-1])


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("-i", "--importon", default=os.path.join(root, "build/cli/importon"))
    parser.add_argument("--repeats", type=int, default=5)
    parser.add_argument("--side", type=int, default=16)
    parser.add_argument("folder", metavar="FOLDER")
    parser.add_argument("files", nargs="+", metavar="FILE")
    args = parser.parse_args()
    slow = 0
    print("%-38s %10s %10s %6s" % ("scene", "importon s", "Mitsuba s", "ratio"))
    with tempfile.TemporaryDirectory() as scratch:
        folder = os.path.join(scratch, "scenes")
        shutil.copytree(args.folder, folder, ignore=shutil.ignore_patterns("refs"), copy_function=shutil.copyfile)
        shrink(folder, args.side)
        for file in args.files:
            path = os.path.join(folder, os.path.relpath(file, args.folder))
            name, times = os.path.basename(file), []
            try:
                for _ in range(args.repeats):
                    times.append((ours(args.importon, path, os.path.join(scratch, "o.exr")), theirs(path)))
            except subprocess.TimeoutExpired:
                print("%-38s Mitsuba hangs" % name, flush=True)
                continue
            except subprocess.CalledProcessError as e:
                said = e.stderr if isinstance(e.stderr, str) else e.stderr.decode(errors="replace")
                print("%-38s %s" % (name, said.strip().splitlines()[-1:]))
                continue
            a, b = (min(t[k] for t in times) for k in range(2))
            slow += a > TOO_MUCH * b
            print("%-38s %10.4f %10.4f %6.2f%s" % (name, a, b, a / b, "  *" if a > TOO_MUCH * b else ""), flush=True)
    print("%d above %d" % (slow, TOO_MUCH))
    return 0


if __name__ == "__main__":
    sys.exit(main())
