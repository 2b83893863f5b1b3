# SPDX-License-Identifier: Apache-2.0
"""The command line that random_scenes.py and random_gradients.py share: scenes FIRST..LAST of random_parts.py, one after the other."""
import argparse
import json
import os
import tempfile

import random_parts
from zcompare import mi, root


def main(doc, spp, runs, look, line):
    """look(args, seed, folder) is a result, which fails if it has a true "fails" or an "error"; line(result) is printed. 1 if one fails."""
    parser = argparse.ArgumentParser(description=doc.splitlines()[0])
    parser.add_argument("-i", "--importon", default=os.path.join(root, "build/cli/importon"))
    parser.add_argument("--mode", default="rgb", choices=["rgb", "mono", "spectral"])
    parser.add_argument("--spp", type=int, default=spp)
    parser.add_argument("--runs", type=int, default=runs)
    parser.add_argument("--json")
    parser.add_argument("first", type=int)
    parser.add_argument("last", type=int)
    args = parser.parse_args()
    mi.set_variant("llvm_ad_" + args.mode)
    mi.set_log_level(mi.LogLevel.Error)
    bad = 0
    for seed in range(args.first, args.last + 1):
        with tempfile.TemporaryDirectory() as folder:
            try:
                result = look(args, seed, folder)
            except (RuntimeError, ValueError, KeyError) as e:
                result = {"seed": seed, "mode": args.mode, "error": str(e)[-600:], "kinds": random_parts.make(seed, args.mode, folder)[1]}
        bad += "error" in result or result.get("fails", False)
        print(line(result), flush=True)
        if args.json:
            with open(args.json, "a") as f:
                print(json.dumps(result), file=f)
    print("%d of %d differ or fail" % (bad, args.last - args.first + 1))
    return 1 if bad else 0
