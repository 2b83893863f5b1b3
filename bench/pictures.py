#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Processor time of pictures and gradients by several versions of the program.

    bench/pictures.py [--rounds N] [--spp N] [--only WORDS] [--differ] IMPORTON OTHER...

One thread, rounds interleaved; the pictures of all programs must have the same bytes (--differ: need not,
and what a program cannot do is left out). Scenes: the
Cornell box, `textured`, and an open scene, which is `textured` with two meshes of 8,064 triangles
with interpolated normals, one of rough gold and one diffuse; `textured` with balls of glass, plastic
and rough glass, with other floors, or under a picture of the sky; wax, a slab of three colours, and a
caustic by light tracing; the office, read by its meters. Losses with gradients compare with a picture
of the same scene by the first program; those by poses, of a block and of an egg of 19,800 facets,
with one of another pose. Behind times of gradients, where they differ: standard errors over those of the
first program, geometric means over the numbers.
"""
import argparse
import json
import math
import os
import resource
import statistics
import subprocess
import sys
import tempfile

SCENES = os.path.join(os.path.dirname(os.path.abspath(__file__)), '..', 'scenes')


def ball(path, phase, centre, radius, n=64):
    """A sphere with waves, as an OBJ file."""
    def point(i, j):
        theta, phi = math.pi * i / n, 2 * math.pi * (j % n) / n
        r = radius * (1 + .05 * math.sin(5 * theta + phase) * math.sin(6 * phi))
        return (centre[0] + r * math.sin(theta) * math.cos(phi), centre[1] + r * math.cos(theta),
                centre[2] + r * math.sin(theta) * math.sin(phi))

    def number(i, j):
        return 1 if i == 0 else 2 + n * (n - 1) if i == n else 2 + (i - 1) * n + j % n
    with open(path, 'w') as f:
        for v in [point(0, 0)] + [point(i, j) for i in range(1, n) for j in range(n)] + [point(n, 0)]:
            f.write('v %.7g %.7g %.7g\n' % v)
        for i in range(n):
            for j in range(n):
                a, b, c, d = number(i, j), number(i, j + 1), number(i + 1, j), number(i + 1, j + 1)
                if i > 0:
                    f.write('f %d %d %d\n' % (a, b, c))
                if i + 1 < n:
                    f.write('f %d %d %d\n' % (b, d, c))


def open_scene(folder):
    ball(folder + '/gold.obj', 1, (-1.3, .75, .2), .7)
    ball(folder + '/clay.obj', 2, (1.6, .6, -.6), .55)
    with open(os.path.join(SCENES, 'textured.xml')) as f:
        text = f.read().replace('textured/', os.path.join(os.path.abspath(SCENES), 'textured/'))
    extra = '''<shape type="obj"><string name="filename" value="gold.obj"/><bsdf type="roughconductor">
<string name="material" value="Au"/><string name="distribution" value="ggx"/>
<float name="alpha" value="0.3"/></bsdf></shape>
<shape type="obj"><string name="filename" value="clay.obj"/><bsdf type="diffuse">
<rgb name="reflectance" value="0.6,0.3,0.2"/></bsdf></shape></scene>'''
    path = folder + '/open.xml'
    with open(path, 'w') as f:
        f.write(text.replace('</scene>', extra))
    return path


def glass_scene(folder):
    path = folder + '/glass.xml'
    with open(os.path.join(SCENES, 'textured.xml')) as f:
        text = f.read().replace('textured/', os.path.join(os.path.abspath(SCENES), 'textured/'))
    extra = ''.join('<shape type="sphere"><point name="center" x="%g" y=".4" z=".6"/>'
                    '<float name="radius" value=".4"/><bsdf type="%s"/></shape>' % (x, kind)
                    for x, kind in ((-1.2, 'dielectric'), (0, 'plastic'), (1.2, 'roughdielectric')))
    with open(path, 'w') as f:
        f.write(text.replace('</scene>', extra + '</scene>'))
    return path


SLAB = '''<scene version="3.0.0"><integrator type="volpath"><integer name="max_depth" value="64"/>
<integer name="rr_depth" value="16"/></integrator><medium type="homogeneous" id="m">
<rgb name="sigma_t" value="1,2,4"/><rgb name="albedo" value=".98,.95,.9"/>
<phase type="hg"><float name="g" value=".6"/></phase></medium>
<shape type="cube"><transform name="to_world"><scale x="4" y=".5" z="4"/></transform><bsdf type="null"/>
<ref id="m" name="interior"/></shape><shape type="rectangle"><transform name="to_world"><scale value="1.5"/>
<lookat origin="0,4,0" target="0,0,0" up="0,0,1"/></transform><emitter type="area">
<rgb name="radiance" value="7,6.5,5.8"/></emitter></shape>
<emitter type="constant"><rgb name="radiance" value=".12,.14,.18"/></emitter>
<sensor type="perspective"><float name="fov" value="40"/><transform name="to_world"><lookat origin=".6,-5,4.6"
target="0,0,0" up="0,1,0"/></transform><film type="hdrfilm"><integer name="width" value="64"/>
<integer name="height" value="64"/><rfilter type="box"/></film></sensor></scene>'''
CAUSTIC = '''<scene version="3.0.0"><integrator type="ptracer"><integer name="max_depth" value="8"/>
<integer name="rr_depth" value="100"/></integrator><sensor type="perspective"><float name="fov" value="30"/>
<transform name="to_world"><lookat origin="0,3,4" target="0,0,1" up="0,1,0"/></transform><film type="hdrfilm">
<integer name="width" value="96"/><integer name="height" value="64"/><rfilter type="box"/></film></sensor>
<shape type="rectangle"><transform name="to_world"><scale value="4"/><rotate x="1" angle="-90"/></transform>
<bsdf type="diffuse"><rgb name="reflectance" value=".5"/></bsdf></shape>
<shape type="rectangle"><transform name="to_world"><scale value=".1"/><rotate x="1" angle="125"/>
<translate y="2.5" z="-2"/></transform><emitter type="area"><rgb name="radiance" value="50"/></emitter></shape>
<shape type="sphere"><float name="radius" value=".6"/><point name="center" x="0" y=".9" z="-.4"/>
<bsdf type="dielectric"><float name="int_ior" value="1.5"/><float name="ext_ior" value="1"/></bsdf></shape></scene>'''


COAT = '<float name="clearcoat" value=".6"/>'
GGX = '<string name="distribution" value="ggx"/>'


def written(folder, name, text):
    path = '%s/%s.xml' % (folder, name)
    with open(path, 'w') as f:
        f.write(text)
    return path


def wax_mesh(folder):
    subprocess.run([sys.executable, os.path.join(SCENES, 'wax', 'make.py'), folder + '/wax.ply'], check=True,
                   capture_output=True)
    return folder + '/wax.ply'


def floor_scene(folder, kind, colour, more=''):
    """`textured` with its floor of another material; more: what else it has."""
    path = '%s/%s%d.xml' % (folder, kind, len(more))
    with open(os.path.join(SCENES, 'textured.xml')) as f:
        text = f.read().replace('textured/', os.path.join(os.path.abspath(SCENES), 'textured/'))
    head, floor = text.split('<bsdf type="diffuse" id="floor">')
    with open(path, 'w') as f:
        f.write(head + '<bsdf type="%s" id="floor">' % kind + more + floor.replace('"reflectance"', '"%s"' % colour, 1))
    return path


def sky_scene(folder):
    path = folder + '/sky.xml'
    with open(os.path.join(SCENES, 'textured.xml')) as f:
        text = f.read().replace('textured/', os.path.join(os.path.abspath(SCENES), 'textured/'))
    picture = os.path.join(os.path.abspath(SCENES), 'textured/waves.png')
    head, rest = text.split('<emitter type="constant" id="sky">')
    sky = '<emitter type="envmap" id="sky"><string name="filename" value="%s"/></emitter>' % picture
    with open(path, 'w') as f:
        f.write(head + sky + rest.split('</emitter>', 1)[1])
    return path


def egg_scene(folder):
    """A ball with waves, of 19,800 flat facets, on a floor under a lamp."""
    ball(folder + '/egg.obj', 0, (0, 0, 1), .8, 100)
    path = folder + '/egg.xml'
    with open(path, 'w') as f:
        f.write('''<scene version="3.0.0"><integrator type="path"><integer name="max_depth" value="4"/></integrator>
<sensor type="perspective" id="camera"><float name="fov" value="45"/><transform name="to_world">
<lookat origin=".4,-4,2.6" target="0,0,.8" up="0,0,1"/></transform><film type="hdrfilm"><integer name="width" value="64"/>
<integer name="height" value="64"/><rfilter type="box"/></film></sensor>
<shape type="rectangle" id="floor"><transform name="to_world"><scale value="3"/></transform><bsdf type="diffuse"/></shape>
<shape type="obj" id="egg"><string name="filename" value="egg.obj"/><boolean name="face_normals" value="true"/>
<bsdf type="diffuse"/></shape>
<shape type="rectangle" id="lamp"><transform name="to_world"><scale value=".7"/><rotate x="1" angle="170"/>
<translate x="1" y="-.4" z="3"/></transform><emitter type="area"><rgb name="radiance" value="9,8,7"/></emitter></shape>
</scene>''')
    return path


def seconds(command):
    before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode:
        raise RuntimeError(done.stderr)
    return resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before, done.stdout


def errors(answer):
    """Standard errors of the numbers of a gradient."""
    each = [p.get('se', 0) for p in json.loads(answer).get('params', [])]
    return [se for own in each for se in (own if isinstance(own, list) else [own]) if se > 0]


def compared(args, name, job, folder):
    """A line of times, ratios, and ratios of errors."""
    picture = folder + '/picture.pfm'
    time = {p: [] for p in args.program}
    bytes_of, se = {}, {}
    spp = args.spp // 4 if 'quarter' in name else args.spp * (8 if '8 times' in name else 1)
    for _ in range(args.rounds):
        for p in args.program:
            for old in (picture, picture + '.manifest'):
                if os.path.exists(old):
                    os.remove(old)
            took, answer = seconds([p, *job, '--spp', str(spp), '-t', '1', '-q'])
            time[p].append(took)
            if 'gradient' in job:
                se[p] = errors(answer)
            if 'render' in job:
                with open(picture, 'rb') as f:
                    bytes_of[p] = f.read()
    if len(set(bytes_of.values())) > 1 and not args.differ:
        sys.exit(name + ': the pictures differ')
    first, se_first = time[args.program[0]], se.get(args.program[0], [])
    line = []
    for p in args.program:
        line.append('%.3f s, %.2f (%.2f)' % (min(time[p]), min(time[p]) / min(first),
                                             statistics.median(time[p]) / statistics.median(first)))
        if len(se_first) == len(se.get(p, [])) and se_first != se.get(p, []):
            line[-1] += ', errors %.2f' % statistics.geometric_mean(b / a for a, b in zip(se_first, se[p]))
    return '  '.join('%-24s' % x for x in line)


def main():
    args = argparse.ArgumentParser(description=__doc__.split('\n')[0])
    args.add_argument('--rounds', type=int, default=5)
    args.add_argument('--spp', type=int, default=64)
    args.add_argument('--only', default='', help='jobs whose name has these words')
    args.add_argument('--differ', action='store_true', help='programs of other versions, which may lack something')
    args.add_argument('program', nargs='+')
    args = args.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        picture = ['-o', folder + '/picture.pfm', '--no-preview']
        cornell = os.path.join(SCENES, 'cornell.xml')
        jobs = {
            'Cornell box': ['render', cornell, '-D', 'res=128', *picture],
            'Cornell box, spectra': ['render', cornell, '-D', 'res=96', '-m', 'spectral', *picture],
            'textured': ['render', os.path.join(SCENES, 'textured.xml'), *picture],
            'open scene': ['render', open_scene(folder), *picture],
            'glass and plastic': ['render', glass_scene(folder), *picture],
            'wax, a quarter of the samples': ['render', os.path.join(SCENES, 'wax.xml'), '-D',
                                              'mesh=' + wax_mesh(folder), *picture],
            'slab of three colours': ['render', written(folder, 'slab', SLAB), *picture],
            'caustic from the lamp, 8 times': ['render', written(folder, 'caustic', CAUSTIC), *picture],
            'floor of principled': ['render', floor_scene(folder, 'principled', 'base_color'), *picture],
            'floor of plastic': ['render', floor_scene(folder, 'plastic', 'diffuse_reflectance'), *picture],
            'floor of principled, coated': ['render', floor_scene(folder, 'principled', 'base_color', COAT), *picture],
            'floor of rough plastic': ['render', floor_scene(folder, 'roughplastic', 'diffuse_reflectance', GGX),
                                       *picture],
            'floor of rough plastic, Beckmann': ['render', floor_scene(folder, 'roughplastic', 'diffuse_reflectance'),
                                                 *picture],
            'picture of the sky': ['render', sky_scene(folder), *picture],
            'functional, Cornell box': ['gradient', cornell, '-D', 'res=64', '--json'],
            'office, read': ['read', os.path.join(SCENES, 'office.xml'), '-m', 'mono', '--json'],
        }
        losses = {'Cornell box': [cornell, '-D', 'res=64'],
                  'textured': [os.path.join(SCENES, 'textured.xml')],
                  'open scene': [folder + '/open.xml']}
        for name, scene in losses.items():
            target = '%s/%s.exr' % (folder, name.replace(' ', '_'))
            subprocess.run([args.program[0], 'render', *scene, '--spp', '16', '-q', '--no-preview', '-o', target],
                           check=True)
            jobs['loss + gradient, ' + name] = ['gradient', *scene, '-T', target, '--json']
        for name, scene, shape in (('block', os.path.join(SCENES, 'poses.xml'), 'block'),
                                   ('egg', egg_scene(folder), 'egg')):
            target = '%s/%s.exr' % (folder, name)
            made = subprocess.run([args.program[0], 'render', scene, '--set', shape + '.pose=.08,.05,0,0,0,.15', '--seed', '77',
                            '--spp', '256', '-q', '--no-preview', '-o', target],
                                  capture_output=args.differ)
            if made.returncode and not args.differ:
                sys.exit('no target')
            if made.returncode:
                continue
            jobs['picture, for pose of ' + name] = ['render', scene, *picture]
            jobs['loss + gradient, pose of ' + name] = ['gradient', scene, '-T', target, '-p', shape + '.pose', '--json']
        print('%-33s %s' % ('', '  '.join('%-24s' % p[-24:] for p in args.program)))
        for name, job in jobs.items():
            if args.only not in name:
                continue
            try:
                print('%-33s %s' % (name, compared(args, name, job, folder)), flush=True)
            except RuntimeError as error:
                if not args.differ:
                    sys.exit(str(error))


if __name__ == '__main__':
    main()
