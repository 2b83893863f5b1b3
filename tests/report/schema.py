#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The data in pages of reports against the published schema.

Usage: schema.py IMPORTON SCENES SCHEMA
"""
import base64
import json
import os
import re
import subprocess
import sys
import tempfile
import zlib

importon, scenes, schema = sys.argv[1:]
try:
    import jsonschema
except ImportError:
    print("1..0 # SKIP no module jsonschema")
    sys.exit(0)
rules = jsonschema.Draft7Validator(json.load(open(schema)))


def run(*words):
    subprocess.run([importon, *words], check=True, capture_output=True)


def data(page):
    text = open(page, encoding="utf-8").read()
    return json.loads(re.search(r'<script type="application/json" id="data">(.*?)</script>', text, re.S)[1])


with tempfile.TemporaryDirectory() as folder:
    cornell, lens = os.path.join(scenes, "cornell.xml"), os.path.join(scenes, "bend", "luneburg.xml")
    common = ["-D", "res=16", "--spp", "8", "-q"]
    run("render", cornell, *common, "--se", "-o", folder + "/t.exr")
    run("fit", cornell, *common, "--target", folder + "/t.exr", "-p", "red.*", "-n", "2", "-o", folder + "/r")
    run("jacobian", cornell, *common, "-p", "red.*", "-o", folder + "/r")
    run("check", cornell, *common, "-p", "red.*", "--json", "-o", folder + "/r/check.json")
    run("bend", "view", lens, "-q", "-o", folder + "/r")
    run("elements", cornell, "-D", "res=16", "-q", "--stop", "20", "--lux", "floor", "--report", folder + "/r/e")
    for name in ("elements.json", "mesh.json"): os.rename(folder + "/r/e/" + name, folder + "/r/" + name)
    run("report", folder + "/r", "--scene", cornell, "-D", "res=16", "-q", "--walks", "2")
    report = data(folder + "/r/report.html")
    poses = os.path.join(scenes, "poses.xml")
    run("render", poses, *common, "-o", folder + "/p.exr")
    run("fit", poses, *common, "--target", folder + "/p.exr", "-p", "block.pose", "--set", "block.pose=.1,0,.1,0,0,0", "-n", "2", "-o", folder + "/q")
    run("report", folder + "/q", "-q")
    moving = data(folder + "/q/report.html")
    report["items"] += moving["items"]
    places = [p for i in moving["items"] if i["kind"] == "fit" for p in i["data"].get("places", [])]
    errors = [e.message[:200] for e in rules.iter_errors(report)]
    kinds = {i["kind"] for i in report["items"]}
    good = not errors and {"picture", "derivative", "fit", "check", "image", "walks", "explained", "elements", "mesh", "rays"} <= kinds and [(p["name"], p["shifts"], len(p["way"])) for p in places] == [("block.pose", [0, 1, 2], 2)]
    print("%sok 1 - a report of everything follows the schema # %s" % ("" if good else "not ", errors or ", ".join(sorted(kinds))))
    sizes = [len(zlib.decompress(base64.b64decode(i[k]))) == 2 * i["width"] * i["height"] * len(i["channels"])
             for i in report["items"] if "pixels" in i for k in ("pixels", "se") if k in i]
    print("%sok 2 - pictures are as long as their sizes say # %d" % ("" if all(sizes) and sizes else "not ", len(sizes)))
    def without(kind, key):
        return {**report, "items": [{**i, "data": {k: v for k, v in i["data"].items() if k != key}} if i["kind"] == kind else i for i in report["items"]]}
    broken = [without("mesh", "elements"), without("walks", "bounds"), without("rays", "box"), without("explained", "chi2"), without("fit", "params"), {**report, "items": [{"kind": "places", "data": {"places": [{"name": "x"}]}}]}, {**report, "version": 1}, {**report, "items": [{"kind": ""}]}, {**report, "items": [{"kind": "picture", "width": 1}]},
              {k: v for k, v in report.items() if k != "items"}]
    caught = [not rules.is_valid(b) for b in broken]
    print("%sok 3 - the schema refuses what is no report" % ("" if all(caught) else "not "))
    print("1..3")
    sys.exit(not (good and all(sizes) and all(caught)))
