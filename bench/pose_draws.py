#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Loss and gradient by poses: variance times processor time of one program over that of another.

    python3 bench/pose_draws.py [--seeds N] [--only WORDS] IMPORTON [IMPORTON...]

The programs take turns, seed by seed; one thread. Of each case: seconds of a gradient, and of the picture of as many
samples; then, over those of the first program, the variance of the gradient between seeds (geometric mean over its
numbers) and that times time, and the same from the errors that the programs state, which is less noisy; and these
over the spread of the seeds. A ratio of variances from N seeds has an error of about 2/sqrt(N) of itself.
"""
import argparse
import json
import math
import os
import resource
import statistics
import subprocess
import tempfile

import edges

here = os.path.dirname(os.path.abspath(__file__))
SCENES = os.path.join(os.path.dirname(here), 'scenes')
ROUND = ('<shape type="cube" id="block">', '<shape type="sphere" id="block"><float name="radius" value=".5"/>')


def ball_scene(folder):
    """The scene of poses with a ball in the place of its block."""
    with open(os.path.join(SCENES, 'poses.xml'), encoding='utf-8') as f:
        text = f.read()
    assert ROUND[0] in text
    text = text.replace(*ROUND).replace('<scale x="0.6" y="0.5" z="0.35"/>', '', 1)
    path = os.path.join(folder, 'round.xml')
    with open(path, 'w', encoding='utf-8') as f:
        f.write(text)
    return path


def mesh_scene(folder, triangles):
    path = os.path.join(folder, 'mesh%d' % triangles)
    os.mkdir(path)
    edges.ball(os.path.join(path, 'ball.obj'), triangles)
    path = os.path.join(path, 'scene.xml')
    with open(path, 'w', encoding='utf-8') as f:
        f.write(edges.SCENE)
    return path


def run(command):
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    done = subprocess.run(command, check=True, capture_output=True, text=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return done.stdout, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def numbers(answer, key):
    each = [p[key] for p in json.loads(answer)['params']]
    return [x for own in each for x in (own if isinstance(own, list) else [own])]


def compared(a, scene, options, pose, away, spp):
    common = [*options, '-t', '1', '-q']
    with tempfile.TemporaryDirectory() as folder:
        target = os.path.join(folder, 'target.exr')
        picture = os.path.join(folder, 'picture.pfm')
        run([a.program[0], 'render', scene, *options, '--set', '%s=%s' % (pose, away), '--spp', '256', '--seed', '77', '-q',
             '--no-preview', '-o', target])
        grad, told, time = ([[] for _ in a.program] for _ in range(3))
        seen = []
        for seed in range(a.seeds):
            seen.append(run([a.program[0], 'render', scene, *common, '--spp', str(spp), '--seed', str(seed), '--no-preview',
                             '-o', picture])[1])
            for k, program in enumerate(a.program):
                answer, used = run([program, 'gradient', scene, *common, '--spp', str(spp), '--seed', str(seed), '-T', target,
                                    '-p', pose, '--json'])
                grad[k].append(numbers(answer, 'grad'))
                told[k].append(numbers(answer, 'se'))
                time[k].append(used)
    variance = [[statistics.variance(x) for x in zip(*g)] for g in grad]
    moving = [j for j in range(len(variance[0])) if all(v[j] > 0 for v in variance)]
    line = 'picture %.3f' % statistics.median(seen)
    for k in range(len(a.program)):
        seconds = statistics.median(time[k])
        ratio = statistics.geometric_mean(variance[k][j] / variance[0][j] for j in moving)
        square = [[statistics.fmean(s[j] ** 2 for s in own) for j in moving] for own in told]
        by_told = statistics.geometric_mean(a / b for a, b in zip(square[k], square[0]))
        stated = statistics.fmean(math.sqrt(s / variance[k][j]) for s, j in zip(square[k], moving))
        times = seconds / statistics.median(time[0])
        line += ' | %.3f s, variance %.2f (told %.2f), x time %.2f (%.2f), told/seen %.2f' % (
            seconds, ratio, by_told, ratio * times, by_told * times, stated)
    return line


def main():
    ap = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    ap.add_argument('--seeds', type=int, default=24)
    ap.add_argument('--only', default='', help='cases whose name has these words')
    ap.add_argument('program', nargs='+')
    a = ap.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        poses, cornell = os.path.join(SCENES, 'poses.xml'), os.path.join(SCENES, 'cornell.xml')
        away = '.08,.05,0,0,0,.15'
        cases = {'block, 16': (poses, [], 'block.pose', away, 16),
                 'block, 64': (poses, [], 'block.pose', away, 64),
                 'block, 256': (poses, [], 'block.pose', away, 256),
                 'block near the truth, 64': (poses, [], 'block.pose', '.002,0,0,0,0,0', 64),
                 'ball, 64': (ball_scene(folder), [], 'block.pose', away, 64),
                 'lamp, 64': (poses, [], 'lamp.pose', away, 64),
                 'camera, 64': (poses, [], 'camera.pose', '.03,0,0,0,.01,0', 64),
                 'Cornell box, 64': (cornell, ['-D', 'res=64'], 'tall_block.pose', '20,0,10,0,.2,0', 64),
                 'mesh of 840, 16': (mesh_scene(folder, 1000), ['-m', 'mono'], 'ball.pose', '.2,.1,.1,0,0,0', 16),
                 'mesh of 9,800, 16': (mesh_scene(folder, 10000), ['-m', 'mono'], 'ball.pose', '.2,.1,.1,0,0,0', 16),
                 'mesh of 99,224, 16': (mesh_scene(folder, 100000), ['-m', 'mono'], 'ball.pose', '.2,.1,.1,0,0,0', 16)}
        for name, case in cases.items():
            if a.only in name:
                print('%-26s %s' % (name, compared(a, *case)), flush=True)


if __name__ == '__main__':
    main()
