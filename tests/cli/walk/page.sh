# SPDX-License-Identifier: Apache-2.0
# The commands of docs/walk-and-sweep.md print what the page shows, and the tables of its
# fold and sweep follow from that walk, to the digits shown.
cd "$ROOT" && python3 - <<'PY'
import json, re, subprocess, sys

def run(command):
    return subprocess.run(command, shell=True, check=True, capture_output=True, text=True).stdout

def expect(what, shown, found):
    if '%.6g' % float(shown) != '%.6g' % found:
        print(f'{what}: the page has {shown}, the walk gives {found:.6g}')
        sys.exit(1)

page = open('docs/walk-and-sweep.md').read()
blocks = re.findall(r'```console\n\$ (importon [^\n]*)\n(.*?)```', page, re.S)
assert len(blocks) == 2
for command, output in blocks:
    if run(command) != output:
        print(f'{command}\nnow prints\n{run(command)}')
        sys.exit(1)

walk = json.loads(run(blocks[0][0] + ' --json'))['vertices']
value = {name: (float(x), float(d)) for name, x, d, se in
         (line.split() for line in blocks[1][1].splitlines())}
value = {name.split('.')[0]: x for name, x in value.items()}
radiance = value['light'][0]

def table(heading):
    rows = re.search(r'\| ' + heading + r'.*?\n\|---.*?\n((?:\|.*\n)+)', page).group(1)
    return [[cell.strip() for cell in row.strip('|').split('|')] for row in rows.splitlines()]

# Fold: last vertex to first, with the tangent in the direction of the lamp's radiance.
E = [v['emission'][0] for v in walk]
B = [v.get('light_sample', [0])[0] for v in walk]
w = [v['weight'][0] for v in walk]
L, tangent = [0.] * (len(walk) + 1), [0.] * (len(walk) + 1)
rows = table(r'k \| shape')
assert len(rows) == len(walk)
for k, row in zip(reversed(range(len(walk))), rows):
    L[k] = E[k] + B[k] + w[k] * L[k + 1]
    tangent[k] = (E[k] + B[k]) / radiance + w[k] * tangent[k + 1]
    assert row[:2] == [str(k), walk[k]['shape']], row
    for shown, found in zip(row[2:], (E[k], B[k], w[k], L[k], tangent[k])):
        expect(f'fold, vertex {k}', shown, found)

# Sweep: first to last.
rows = table(r'k \| BSDF')
assert len(rows) == len(walk)
P, total = 1., dict.fromkeys(value, 0.)
for k, row in enumerate(rows):
    bsdf = walk[k]['bsdf']
    of_rho = P * (B[k] + w[k] * L[k + 1]) / value[bsdf][0]
    of_light = P * (E[k] + B[k]) / radiance
    assert row[:2] == [str(k), bsdf], row
    for shown, found in zip(row[2:], (P, L[k + 1], of_rho, of_light)):
        expect(f'sweep, vertex {k}', shown, found)
    total[bsdf] += of_rho
    total['light'] += of_light
    P *= w[k]

# The sums are the program's gradient.
shown, sixth = re.search(r'of `white`, ([0-9.]+)/6 = ([0-9.]*\d)', page).groups()
expect('white', shown, total['white'])
expect('white', sixth, total['white'] / 6)
for name, (_, gradient) in value.items():
    if abs(gradient - total[name] / 6) > 1e-6 * abs(gradient):
        sys.exit(f'{name}: gradient {gradient}, sum of pieces {total[name] / 6}')
expect('sum', re.search(r'pieces of Le, ([0-9.]*\d)', page).group(1), tangent[0])
expect('product', re.search(r'20.710837 · [0-9.]+ = ([0-9.]*\d)', page).group(1), L[0])
PY
