#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Draw random walks in a box, like Stam's visualizer (Stam 2020, Figure 5).

    importon render SCENE --paths walks.jsonl --count 60
    docs/draw_paths.py walks.jsonl paths.svg [--box LO HI] [--sphere X,Y,Z,R]

Reads what `--paths` or `--pixel --json` write. A segment's opacity is the walk's throughput there,
vertices that emit are filled, and the box is drawn in the same perspective.
"""
import argparse, json, math

EYE, TARGET, SIZE, ZOOM = (2.7, 1.9, 4.2), (0.05, -0.1, 0), 420, 1.5


def unit(v):
    n = math.sqrt(sum(x * x for x in v))
    return [x / n for x in v]


def cross(a, b):
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def dot(a, b):
    return sum(x * y for x, y in zip(a, b))


FORWARD = unit([t - e for t, e in zip(TARGET, EYE)])
RIGHT = unit(cross(FORWARD, (0, 1, 0)))
UP = cross(RIGHT, FORWARD)


def project(p):
    d = [x - e for x, e in zip(p, EYE)]
    scale = ZOOM * SIZE / dot(d, FORWARD)
    return SIZE / 2 + scale * dot(d, RIGHT), SIZE / 2 - scale * dot(d, UP), scale


def line(a, b, style):
    (x1, y1, _), (x2, y2, _) = project(a), project(b)
    return f'<line x1="{x1:.1f}" y1="{y1:.1f}" x2="{x2:.1f}" y2="{y2:.1f}" {style}/>'


def box(lo, hi):
    corner = [[(lo, hi)[k >> i & 1] for i in range(3)] for k in range(8)]
    return [line(corner[k], corner[k | 1 << i], 'stroke="#999" stroke-width="1"')
            for k in range(8) for i in range(3) if not k >> i & 1]


def walk(w):
    out, at = [], w['origin']
    for v in w['vertices']:
        end = v.get('position') or [p + d for p, d in zip(at, v['escapes'])]
        share = min(1, max(v['throughput']))
        out.append(line(at, end, f'stroke="#b22" stroke-width="1.4" opacity="{max(share, .15):.2f}"'))
        if 'position' in v:
            x, y, _ = project(end)
            fill = '#f4b400' if max(v['emission']) > 0 else 'white'
            out.append(f'<circle cx="{x:.1f}" cy="{y:.1f}" r="2.6" fill="{fill}" stroke="#333" '
                       'stroke-width=".8"/>')
        at = end
    x, y, _ = project(w['origin'])
    return out + [f'<rect x="{x - 3:.1f}" y="{y - 3:.1f}" width="6" height="6" fill="#226"/>']


def main():
    a = argparse.ArgumentParser(description=__doc__.split('\n')[0])
    a.add_argument('walks')
    a.add_argument('svg')
    a.add_argument('--box', nargs=2, type=float, default=(-1, 1), metavar=('LO', 'HI'))
    a.add_argument('--sphere', metavar='X,Y,Z,R')
    o = a.parse_args()
    with open(o.walks) as f:
        walks = [json.loads(text) for text in f if text.strip()]
    parts = box(*o.box)
    if o.sphere:
        *centre, radius = map(float, o.sphere.split(','))
        x, y, scale = project(centre)
        parts.append(f'<circle cx="{x:.1f}" cy="{y:.1f}" r="{radius * scale:.1f}" fill="#ddd" stroke="none" '
                     'opacity=".7"/>')
    for w in walks:
        parts += walk(w)
    with open(o.svg, 'w') as f:
        f.write(f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {SIZE} {SIZE}" width="{SIZE}" '
                f'height="{SIZE}"><rect width="100%" height="100%" fill="white"/>\n')
        f.write('\n'.join(parts) + '\n</svg>\n')


if __name__ == '__main__':
    main()
