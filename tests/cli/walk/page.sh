# SPDX-License-Identifier: Apache-2.0
# The commands of docs/walk-and-sweep.md print what the page shows, and the tables of its
# fold and sweep follow from that walk, to the digits shown; so does the table of the walk through
# fog. (The walk from a light: tests/grad/light_page.c.)
cd "$ROOT" && python3 - <<'PY'
import json, math, re, subprocess, sys

def run(command):
    return subprocess.run(command, shell=True, check=True, capture_output=True, text=True).stdout

def expect(what, shown, found):
    if '%.6g' % float(shown) != '%.6g' % found:
        print(f'{what}: the page has {shown}, the walk gives {found:.6g}')
        sys.exit(1)

page = open('docs/walk-and-sweep.md').read()
flat = ' '.join(page.split())  # wherever its lines break
blocks = re.findall(r'```console\n\$ (importon [^\n]*)\n(.*?)```', page, re.S)
assert len(blocks) == 4
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
shown, sixth = re.search(r'of `white`, ([0-9.]+)/6 = ([0-9.]*\d)', flat).groups()
expect('white', shown, total['white'])
expect('white', sixth, total['white'] / 6)
for name, (_, gradient) in value.items():
    if abs(gradient - total[name] / 6) > 1e-6 * abs(gradient):
        sys.exit(f'{name}: gradient {gradient}, sum of pieces {total[name] / 6}')
expect('sum', re.search(r'pieces of Le, ([0-9.]*\d)', flat).group(1), tangent[0])
expect('product', re.search(r'20.710837 · [0-9.]+ = ([0-9.]*\d)', flat).group(1), L[0])

# Through fog: transmittance from the places, pieces of albedo and of white.
scene = open('scenes/fog.xml').read()
sigma, albedo = (float(re.search(f'name="{n}" value="([0-9.]+)"', scene).group(1)) for n in ('sigma', 'albedo'))
walk = json.loads(run(blocks[2][0].split(' | ')[0] + ' --json'))['vertices'][1:]  # 0: the sensor, in the fog
B = [v.get('light_sample', [0])[0] for v in walk]
w = [v.get('weight', [0])[0] for v in walk]
L = [0.] * (len(walk) + 1)
for k in reversed(range(len(walk))):
    L[k] = B[k] + w[k] * L[k + 1]
rows = table(r'k \| vertex')
assert len(rows) == len(walk)
P, total = 1., {'fog': 0., 'white': 0.}
for k, row in enumerate(rows):
    bsdf = walk[k]['bsdf']
    assert row[:2] == [str(k), walk[k]['shape'] or 'fog'], row
    if row[2]:
        d = math.dist(walk[k]['position'], walk[k]['light_position'])
        expect(f'distance, vertex {k}', row[2], d)
        expect(f'transmittance, vertex {k}', row[3], math.exp(-sigma * d))
    assert bool(row[2]) == (B[k] > 0)
    piece = P * L[k] / {'fog': albedo, 'white': .7}[bsdf]
    for shown, found in zip(row[4:8], (B[k], w[k], L[k], P)):
        expect(f'fog, vertex {k}', shown, found)
    expect(f'piece, vertex {k}', row[8 if bsdf == 'fog' else 9], piece)
    assert not row[9 if bsdf == 'fog' else 8]
    total[bsdf] += piece
    P *= w[k]
value = {name: float(d) for name, x, d, se in (line.split() for line in blocks[3][1].splitlines() if 'mean' not in line)}
for what, times, name in (('fog', 2.4, 'fog.albedo.value'), ('white', 1, 'white.reflectance.value[0]')):
    shown, result = re.search(r'%s([0-9.]+)/6 = ([0-9.]*\d)' % ('2\\.4 · ' if what == 'fog' else 'white has '), flat).groups()
    expect(what, shown, total[what])
    expect(what, result, times * total[what] / 6)
    if abs(value[name] - times * total[what] / 6) > 1e-6 * value[name]:
        sys.exit(f'{name}: gradient {value[name]}, sum of pieces {times * total[what] / 6}')
sigma_t, scale = map(float, re.search(r'\.25 · ([0-9.]+) = ([0-9.]*\d)', flat).groups())
if sigma_t != value['fog.sigma_t.value'] or scale != value['fog.scale.value'] or abs(value['fog.scale.value'] - sigma * value['fog.sigma_t.value']) > 1e-6 * value['fog.scale.value']:
    sys.exit('scale is not sigma times sigma_t')
PY
