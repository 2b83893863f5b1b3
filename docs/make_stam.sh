#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
#
# Everything in docs/stam.md that was computed, computed again: its pictures, and the parts between
# "<!-- NAME -->" and "<!-- /NAME -->", which nobody writes by hand. Four to ten minutes.
#
#     docs/make_stam.sh [BUILD FOLDER, default build]
set -euo pipefail
cd "$(dirname "$0")/.."
build=$(cd "${1:-build}" && pwd)
importon=$build/cli/importon
[[ -x $importon ]] || { echo "$importon: not built" >&2; exit 2; }
out=$(mktemp -d)
trap 'rm -rf "$out"' EXIT
stam=(-m mono scenes/stam.xml)

say() { echo "$(date +%T) $*" >&2; }

say "Figure 5: one path, and many"
"$importon" render "${stam[@]}" --pixel 16,16 --sample 39 --json >"$out/path.jsonl"
"$importon" render "${stam[@]}" --paths "$out/paths.jsonl" --count 40 -q
docs/draw_paths.py "$out/path.jsonl" docs/images/stam_path.svg --sphere 0,0,0,.5
docs/draw_paths.py "$out/paths.jsonl" docs/images/stam_paths.svg --sphere 0,0,0,.5

say "Figure 6: adjoint against differences"
"$importon" check "${stam[@]}" --fresh-spp 1024 --json -q >"$out/check.json" || true

say "Figures 7 and 8: gradient pictures"
for sampling in cosine mixture; do
    "$importon" jacobian "${stam[@]}" -D sampling=$sampling --spp 512 -o "$out/$sampling" \
        --sheet "docs/images/stam_$sampling.png" --overwrite --json -q >"$out/$sampling.json"
done

say "Section 5: the optimiser's loop"
"$importon" render "${stam[@]}" -D integrator=path --spp 32768 --seed 9 --se -o "$out/target.exr" -q
start=(sphere.ambient=.026 sphere.diffuse=.35 sphere.specular=.39 sphere.exponent=14
    walls.ambient=.021 walls.diffuse=.39 light.emission=6.5)
fit=(fit "${stam[@]}" -D integrator=path --target "$out/target.exr" --loss relative -q)
for value in "${start[@]}"; do fit+=(--set "$value"); done
"$importon" "${fit[@]}" --spp 128 --picture-spp 2048 -o "$out/fit" --sheet docs/images/stam_fit.png --overwrite --json \
    >"$out/adam.json"
"$importon" "${fit[@]}" --optimizer lm --spp 1024 --json >"$out/lm.json"

say "The errata"
for variant in microfacet paper; do
    for form in detached paper; do
        "$importon" jacobian "${stam[@]}" -D variant=$variant -D alpha_gradient=$form --spp 1024 \
            -p sphere.exponent.value -o "$out/e9" --json >"$out/e9_${variant}_$form.json" \
            2>"$out/e9_${variant}_$form.txt"
    done
done
"$importon" jacobian "${stam[@]}" -D alpha_gradient=attached -p sphere.exponent.value -o "$out/e9" \
    2>"$out/attached.txt" >/dev/null || true
"$build/tests/grad/stam_errata" >"$out/errata.tap"
"$build/tests/grad/stam_formulas" >"$out/formulas.tap"

python3 - "$out" docs/stam.md <<'PYTHON'
import json, re, sys

out, page = sys.argv[1:]
load = lambda name: json.load(open(f'{out}/{name}.json'))
short = lambda name: name.removesuffix('.value')
def table(head, rows):
    return '\n'.join('| ' + ' | '.join(row) + ' |'
                     for row in [head, ['---'] * len(head)] + rows)

rows = load('check')['rows']
frozen, fresh, other = {}, [], {}
for r in rows:
    if r['method'] == 'frozen':
        frozen.setdefault(short(r['param']), {})[r['step']] = r['error']
    elif r['method'] == 'fresh':
        fresh.append([short(r['param']), f"{r['value']:.5g}", f"{r['reference']:.5g}",
                      f"{r['error']:.2f}"])
    else:
        other[r['method']] = max(other.get(r['method'], 0), r['error'])
steps = sorted(next(iter(frozen.values())), reverse=True)
part = {}
part['frozen'] = table(['control'] + [f'h = {h:g}' for h in steps],
                       [[c] + [f'{e[h]:.1e}' for h in steps] for c, e in frozen.items()])
part['identities'] = '\n'.join(f'- `{m}`: worst walk {e:.1e}' for m, e in other.items())
part['fresh'] = table(['control', 'gradient', 'difference', 'z'], fresh)

cosine, mixture = load('cosine')['controls'], load('mixture')['controls']
part['pictures'] = table(
    ['mean derivative', 'cosine', 'mixture', 'errors, cosine/mixture'],
    [[short(a['name']), f"{a['mean']:.5g} +- {a['se']:.2g}", f"{b['mean']:.5g} +- {b['se']:.2g}",
      f"{a['se'] / b['se']:.1f}"] for a, b in zip(cosine, mixture)])

truth = {'sphere.ambient': .02, 'sphere.diffuse': .5, 'sphere.specular': .3, 'sphere.exponent': 20,
         'walls.ambient': .03, 'walls.diffuse': .3, 'light.emission': 5}
def fit(name):
    f = load(name)
    lines = table(['control', 'truth', 'start', 'recovered', 'off by', '95 % interval'],
                  [[short(p['name']), f"{truth[short(p['name'])]:g}", f"{p['start']:g}",
                    f"{p['value']:.4g}", f"{100 * (p['value'] / truth[short(p['name'])] - 1):+.1f} %",
                    f"[{p['lo95']:.4g}, {p['hi95']:.4g}]"] for p in f['params']])
    return f"{lines}\n\n{f['iterations']} iterations of {f['spp']} samples per pixel: {f['reason']}."
part['adam'], part['lm'] = fit('adam'), fit('lm')

reference = {'microfacet': '.000388', 'paper': '-.000189'}
e9 = []
for variant in reference:
    line = [f'`variant={variant}`', reference[variant]]
    for form in ('detached', 'paper'):
        c = load(f'e9_{variant}_{form}')['controls'][0]
        line.append(f"{c['mean']:.3g} +- {c['se']:.1g}")
    e9.append(line)
part['exponent'] = table(['mean of d/d exponent', 'truth', '`alpha_gradient=detached`',
                          '`alpha_gradient=paper`'], e9)
part['exponent'] += '\n\n```text\n' + open(f'{out}/e9_paper_paper.txt').read().strip() + '\n' + \
    open(f'{out}/attached.txt').read().strip() + '\n```'
lines = [line for name in ('errata', 'formulas') for line in open(f'{out}/{name}.tap')
         if re.search(r'E\d', line)]
part['errata'] = '```text\n' + ''.join(re.sub(r'^ok \d+ - ', '', line) for line in lines) + '```'

text = open(page).read()
for name, body in part.items():
    body = re.sub(re.escape(out), 'out', body)
    text, n = re.subn(rf'(<!-- {name} -->\n).*?(<!-- /{name} -->)',
                      lambda m: m[1] + '\n' + body + '\n\n' + m[2], text, flags=re.S)
    if n != 1:
        sys.exit(f'{page}: no place for {name}')
open(page, 'w').write(text)
PYTHON
say "docs/stam.md and docs/images/stam_*.png are new"
