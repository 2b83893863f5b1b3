#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Which source files the jobs of bench/versions.c run, for `linked_first` in src/meson.build and cli/meson.build.

    meson setup build-order -Dcpu=baseline -Ddebug=true -Doptimization=3 && ninja -C build-order cli/importon
    bench/link_order.py build-order

The kernel maps 16 pages of a file where one is touched, so that a file's place in the link decides what is in memory beside it.
Prints a line for each set of jobs, r (picture), g (loss and gradient), c (check), where a capital letter is the textured scene.
Needs valgrind.
"""

import os
import re
import subprocess
import sys
import tempfile

CORNELL = ['cornell.xml', '-D', 'res=16']
TEXTURED = ['textured.xml', '-D', 'width=32', '-D', 'height=24']
CHECK = ['--paths', '20', '--fresh-spp', '4']
JOBS = {
    'r': ['render', *CORNELL, '--spp', '4', '--no-preview', '-o', 'r.exr'],
    'R': ['render', *TEXTURED, '--spp', '4', '--no-preview', '-o', 'R.exr'],
    'g': ['gradient', *CORNELL, '--spp', '4', '-T', 'r.exr'],
    'G': ['gradient', *TEXTURED, '--spp', '4', '-T', 'R.exr'],
    'c': ['check', *CORNELL, *CHECK],
    'C': ['check', *TEXTURED, *CHECK, '-p', '*reflectance*'],
}


def files_of(profile):
    """Source files of functions that ran, from a file of callgrind."""
    names, found = {}, set()
    current = ''
    for line in open(profile):
        m = re.match(r'c?f[lie]=\((\d+)\)(?: (.*))?$', line)
        if m and m[2]:
            names[m[1]] = m[2]
        if m and line.startswith('fl='):
            current = names[m[1]]
        # Inline functions of headers come with fi= and fe=; cost lines follow the function's own.
        if line.startswith('fn='):
            found.add(current)
    return found


def main():
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    importon = os.path.realpath(os.path.join(sys.argv[1], 'cli/importon'))
    root = os.path.dirname(os.path.dirname(os.path.realpath(__file__)))
    jobs = {}
    with tempfile.TemporaryDirectory() as folder:
        for name, words in JOBS.items():
            words = [os.path.join(root, 'scenes', w) if w.endswith('.xml') else w for w in words]
            subprocess.run(['valgrind', '--tool=callgrind', '--callgrind-out-file=profile', importon, *words, '-q', '-t', '1'],
                           cwd=folder, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, check=False)
            for path in files_of(os.path.join(folder, 'profile')):
                m = re.search(r'/(src|cli)/(?:.*/)?(\w+)\.c$', path)
                if m:
                    jobs.setdefault((m[1], m[2]), set()).add(name)
    for room in 'src', 'cli':
        print(room)
        sets = {}
        for (where, stem), of in jobs.items():
            if where == room:
                sets.setdefault(''.join(j for j in JOBS if j in of), []).append(stem)
        for of in sorted(sets, key=lambda s: (-len(s), s)):
            print(f'  {of}:', ' '.join(sorted(sets[of])))


main()
