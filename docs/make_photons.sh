#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
#
# Everything in docs/adjoint-photons.md that was computed, computed again: its pictures, and the
# parts between "<!-- NAME -->" and "<!-- /NAME -->". Six to eight minutes. With the name of a figure
# (1, 2, 3, 4, 5 or 11) that one alone, with "ends" the tables of which end to use.
#
#     docs/make_photons.sh [BUILD FOLDER, default build] [FIGURE]
set -euo pipefail
cd "$(dirname "$0")/.."
build=$(cd "${1:-build}" && pwd)
figure=${2:-all}
importon=$build/cli/importon
[[ -x $importon ]] || { echo "$importon: not built" >&2; exit 2; }
out=$(mktemp -d)
trap 'rm -rf "$out"' EXIT
images=docs/images

say() { echo "$(date +%T) $*" >&2; }
wanted() { [[ $figure == all || $figure == "$1" ]]; }
# twice NAME OPTIONS...: two pictures with different seeds, whose difference is their noise.
twice() {
    local name=$1
    shift
    "$importon" render "$@" --seed 1 -q --no-preview -o "$out/$name.a.exr"
    "$importon" render "$@" --seed 2 -q --no-preview -o "$out/$name.b.exr"
    "$importon" compare "$out/$name.a.exr" "$out/$name.b.exr" --json >"$out/$name.json" || true
}
picture() { # NAME OPTIONS...
    "$importon" render "${@:2}" --seed 1 -q --overwrite --no-manifest -o "$images/photons_$1.png"
}

if wanted 1; then
    say "Figure 1: instances, smoke, sky and sun"
    picture cottage scenes/photons/cottage.xml -D width=240 -D height=135 --spp 256
fi
if wanted 2; then
    say "Figure 2: a ball of glass between two plates, both ways"
    picture lens_sensor scenes/photons/lens.xml -D picture=pattern -D res=96 --spp 1000 --from sensor --exposure 2
    picture lens_lights scenes/photons/lens.xml -D picture=pattern -D res=96 --spp 3000 --from lights --exposure 2
    for emits in left right; do
        "$importon" read scenes/photons/lens.xml -m spectral -D emits=$emits --spp 400000 --ends --json >"$out/lens_$emits.json"
    done
fi
if wanted ends; then
    say "Which end: time to 1 %, rays a second; the headlamp's derivatives"
    "$build/bench/which_end" 2 >"$out/which_end.txt"
    for end in lights sensor; do
        "$importon" read scenes/headlamp.xml -m mono -s 0 -p '*' --from $end --spp 2000000 -q --json >"$out/headlamp_$end.json"
    done
fi
if wanted 3; then
    say "Figure 3: weights of material and environment"
    for w in 1,0 .75,.25 .5,.5 .25,.75; do
        weights=kernel=${w%,*},environment=${w#*,}
        twice "sky_$w" scenes/photons/sky.xml -D "weights=$weights" -D spp=64
    done
    picture sky_kernel scenes/photons/sky.xml -D weights=kernel=1 -D spp=64
    picture sky_mixed scenes/photons/sky.xml -D weights=kernel=1,environment=1 -D spp=64
fi
if wanted 4; then
    say "Figure 4: mixture and MIS"
    "$build/tests/stat/reflector" >"$out/reflector.tap"
    # `split` is no property of Mitsuba's, so the scene of this repository does without.
    sed "s|.*name=\"max_depth\" value=\"\$.*|&<integer name=\"split\" value=\"\$split\"/>|
        s|.*<default name=\"max_depth\".*|&<default name=\"split\" value=\"0\"/>|
        s|filename\" value=\"|&$PWD/scenes/|" scenes/cornell.xml >"$out/box.xml"
    box=("$out/box.xml" -D res=96 -D integrator=photons --weights kernel=1,emitters=1)
    picture mixture "${box[@]}" --spp 400
    picture mis_rays "${box[@]}" -D split=6 --spp 190
    picture mis_time "${box[@]}" -D split=6 --spp 135
    # Seconds of one thread for so many paths; the least of three.
    for setting in "path 0" "photons 0" "photons 1" "photons 2" "photons 6"; do
        read -r integrator split <<<"$setting"
        weights=kernel=1
        [[ $integrator == photons ]] && weights=kernel=1,emitters=1
        for _ in 1 2 3; do
            TIMEFORMAT=%U
            { time "$importon" render -t 1 "$out/box.xml" -m mono -D res=64 -D integrator="$integrator" \
                -D split="$split" --weights $weights --spp 256 --no-preview -q --overwrite -o "$out/t.exr"; } 2>&1
        done | sort -n | head -1 >"$out/time_${integrator}_$split"
    done
fi
if wanted 11; then
    say "Figure 11: a colour chart by 4, 16 and 49 wavelengths a pixel"
    for how in independent stratified; do
        for n in 4 16 49; do
            picture chart_${how}_$n scenes/photons/chart.xml -m single -D spp=$n --wavelengths $how --wavelength-set $n
        done
    done
fi
if wanted 5; then
    say "Figure 5: the bulb, or the opening of its reflector"
    for aim in emitters proxies; do
        twice "reflector_$aim" scenes/photons/reflector.xml -D weights=kernel=1,$aim=1 -D spp=256
        picture reflector_$aim scenes/photons/reflector.xml -D weights=kernel=1,$aim=1 -D spp=256
        "$importon" check --verify-sampling scenes/photons/reflector.xml -D weights=kernel=1,$aim=1 -D res=16 --spp 256 \
            --json -q >"$out/energy_$aim.json" || true
    done
fi

python3 - "$out" docs/adjoint-photons.md <<'PYTHON'
import json, math, os, re, sys

out, page = sys.argv[1:]
text = open(page).read()

def has(name): return os.path.exists(os.path.join(out, name))
def read(name): return open(os.path.join(out, name)).read()
def noise(name):
    r = json.loads(read(name + ".json"))
    return r["rmse"] / math.sqrt(2), r["mean_test"]
def put(name, body):
    global text
    text, n = re.subn(r"(<!-- %s -->\n).*?(<!-- /%s -->)" % (name, name),
                      lambda m: m[1] + "\n" + body + "\n" + m[2], text, flags=re.S)
    assert n == 1, name

if has("sky_1,0.json"):
    rows = ["| weights: kernel, environment | rms noise / mean | variance / kernel's |", "|---|---|---|"]
    first = None
    for w in ("1,0", ".75,.25", ".5,.5", ".25,.75"):
        n, mean = noise("sky_" + w)
        first = first or n
        rows.append("| %s | %.3f | %.3f |" % (w.replace(",", ", "), n / mean, (n / first) ** 2))
    put("weights", "\n".join(rows) + "\n")
if has("lens_left.json"):
    rows = ["| emits | from the sensor | from the lamp | z |", "|---|---|---|---|"]
    for emits, what in (("left", "the lamp, read through the response"), ("right", "the response, read through the lamp's spectrum")):
        r = json.loads(read("lens_%s.json" % emits))["readings"][0]
        l = r["from_lights"]
        rows.append("| %s | %.5f +- %.5f | %.5f +- %.5f | %.1f |" % (what, r["value"], r["se"], l["value"], l["se"], r["z"]))
    put("lens", "\n".join(rows) + "\n")
if has("which_end.txt"):
    cells = [[c.strip() for c in line.strip("|\n").split("|")] for line in read("which_end.txt").splitlines()[2:]]
    for r in cells: # light that an end does not bring
        means = [float(x) for x in r[7].split()]
        for e, mean in enumerate(means):
            if mean < 0.9 * means[0]:
                r[1 + e] += " (lacks %.0f %% of the light)" % (100 * (1 - mean / means[0]))
    for name, first, head in (("which_end", 1, "scene | from the sensor, s | light tracing, s | bidirectional, s"),
                              ("rates", 4, "scene | from the sensor | light tracing | bidirectional")):
        put(name, "\n".join(["| %s |" % head, "|---|---|---|---|"] +
                            ["| " + " | ".join([r[0]] + r[first:first + 3]) + " |" for r in cells]) + "\n")
if has("headlamp_sensor.json"):
    of = [json.loads(read("headlamp_%s.json" % end))["readings"][0] for end in ("lights", "sensor")]
    rows = ["| | from the lamp | from the meter |", "|---|---|---|",
            "| reading, lx | " + " | ".join("%.4g +- %.1g" % (r["value"], r["se"]) for r in of) + " |"]
    for a, b in zip(of[0]["derivatives"], of[1]["derivatives"]):
        rows.append("| d/d `%s` | " % a["name"] + " | ".join("%.5g +- %.1g" % (d["grad"][0], d["se"][0]) for d in (a, b)) + " |")
    put("headlamp", "\n".join(rows) + "\n")
if has("reflector.tap"):
    cost = {}
    for m in re.finditer(r"^#   (.*?) +[\d.]+ of [\d.]+, paths x ([\d.]+), rays a path ([\d.]+)", read("reflector.tap"), re.M):
        cost[m[1]] = float(m[2]), float(m[3])
    names = (("path", "path 0", "path tracer"), ("photons, h 1", "photons 0", "mixture"),
             ("photons, split 1", "photons 1", "MIS at the first vertex"),
             ("photons, split 2", "photons 2", "MIS at two vertices"), ("photons, split 6", "photons 6", "MIS everywhere"))
    seconds = {k: float(read("time_" + k.replace(" ", "_"))) for _, k, _ in names}
    paths = 64 * 64 * 256
    rows = ["| | paths for one error | rays a path | us a path | rays for one error | time for one error |",
            "|---|---|---|---|---|---|"]
    p, r = cost["path"]
    for name, key, what in names:
        v, rays = cost[name]
        rows.append("| %s | %.1f | %.2f | %.2f | %.1f | %.1f |" % (
            what, v, rays, 1e6 * seconds[key] / paths, v * rays / (p * r), v * seconds[key] / seconds["path 0"]))
    put("mis", "\n".join(rows) + "\n")
if has("reflector_emitters.json"):
    rows = ["| aimed at | rms noise / mean | energy by material's directions | by aimed directions |", "|---|---|---|---|"]
    for aim, what in (("emitters", "the bulb"), ("proxies", "the opening")):
        n, mean = noise("reflector_" + aim)
        part = {r["param"]: r["value"] for r in json.loads(read("energy_%s.json" % aim))["rows"] if r["method"] == "energy"}
        rows.append("| %s | %.2f | %.3f | %.3f |" % (what, n / mean, part.get("kernel", 0), part.get(aim, 0)))
    put("reflector", "\n".join(rows) + "\n")
open(page, "w").write(text)
PYTHON
for picture in "$images"/photons_*.png; do
    bytes=$(stat -c %s "$picture")
    ((bytes < 60000)) || { echo "$picture is larger than 60000 bytes" >&2; exit 1; }
done
