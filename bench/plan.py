#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""What a plan costs: processor seconds of a candidate over those of its picture, and memory by their number.

    bench/plan.py [--size N] [--spp S] [--candidates A,B,..] PROGRAM

PROGRAM is a cli/importon. Candidates are cameras in front of the Cornell box, whose 15 numbers and the five
of its film are active. The picture is that of the same camera and samples, the
median of three; each plan runs once, one thread. Prints for each number of candidates seconds, seconds of a
candidate over those of a picture, and the peak of the memory.
"""
import argparse
import os
import re
import statistics
import sys
import tempfile

TOP = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))


def scene(folder):
    """The Cornell box with a film that has exposure, balance and vignetting: 20 numbers."""
    text = open(os.path.join(TOP, "scenes", "cornell.xml")).read()
    film = "".join('<float name="%s" value="%s"/>' % pair for pair in (
        ("exposure", 1), ("white_balance_red", 1), ("white_balance_blue", 1), ("vignetting_2", -.1), ("vignetting_4", 0)))
    text, n = re.subn(r'(<film type="hdrfilm">)', r"\1" + film, text)
    if n != 1:
        sys.exit("plan.py: scenes/cornell.xml has no film to change")
    path = os.path.join(folder, "cornell.xml")
    with open(path, "w") as f:
        f.write(text)
    if os.path.isdir(os.path.join(TOP, "scenes", "cornell")):
        os.symlink(os.path.join(TOP, "scenes", "cornell"), os.path.join(folder, "cornell"))
    return path


def run(command):
    """Processor seconds and peak memory in MB of a child, and what it prints."""
    read, write = os.pipe()
    child = os.fork()
    if child == 0:
        os.dup2(write, 1)
        os.execvp(command[0], command)
    os.close(write)
    with os.fdopen(read) as f:
        text = f.read()
    _, status, used = os.wait4(child, 0)
    if status:
        sys.exit("plan.py: %s failed" % " ".join(command))
    return used.ru_utime + used.ru_stime, used.ru_maxrss / 1024, text


def main():
    a = argparse.ArgumentParser()
    a.add_argument("--size", type=int, default=128)
    a.add_argument("--spp", type=int, default=64)
    a.add_argument("--candidates", default="10,50")
    a.add_argument("program")
    a = a.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        path = scene(folder)
        base = [path, "-D", "res=%d" % a.size, "--spp", str(a.spp), "-t", "1", "-q"]
        picture = statistics.median(
            run([a.program, "render", *base, "-o", os.path.join(folder, "x%d.exr" % k)])[0] for k in range(3))
        print("picture %.2f s" % picture)
        for n in map(int, a.candidates.split(",")):
            with open(os.path.join(folder, "places"), "w") as f:
                for k in range(n):
                    f.write("%g %g -800  278 273 0\n" % (178 + 20 * (k % 10), 200 + 30 * (k // 10)))
            s, mb, text = run([a.program, "plan", *base, "--path", os.path.join(folder, "places")])
            numbers = len(re.findall(r"^\S+\.\S+(?:\[\d\])?  ", text, re.M))
            print("%3d candidates, %d numbers: %.1f s, %.1f pictures a candidate, peak %.0f MB"
                  % (n, numbers, s, s / n / picture, mb), flush=True)


main()
