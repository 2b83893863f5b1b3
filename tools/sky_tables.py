#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The tables of src/kind/emitter/skylight.h.

    sky_tables.py make DATASETS.bin TABLES.txt     the text from the tables of Hosek and Wilkie,
                                                   as Mitsuba 3.9's package carries them
                                                   (data/sunsky/sunsky_datasets.bin)
    sky_tables.py embed TABLES.txt OUT.c           C from the text: what the build calls

Only the first needs NumPy, and is needed to make the text again.
"""
import math
import sys

TABLES = {'sky_params_rgb': ('imp__sky_rgb_numbers', (10, 2, 6, 3, 9)),
          'sky_rad_rgb': ('imp__sky_rgb_radiance', (10, 2, 6, 3)),
          'sky_params_spec': ('imp__sky_spec_numbers', (10, 2, 6, 11, 9)),
          'sky_rad_spec': ('imp__sky_spec_radiance', (10, 2, 6, 11)),
          'sun_rad_spec': ('imp__sun_spec_radiance', (10, 45, 11, 4)),
          'sun_ld_spec': ('imp__sun_spec_limb', (11, 6))}

LICENCE = '''The clear-sky model of Lukas Hosek and Alexander Wilkie: "An Analytic Model for Full Spectral
Sky-Dome Radiance" (2012) and "Adding a Solar Radiance Function to the Hosek Skylight Model" (2013),
http://cgg.mff.cuni.cz/projects/SkylightModelling/ . Numbers as published, in the order of
tools/sky_tables.py.

Copyright (c) 2012 - 2013, Lukas Hosek and Alexander Wilkie
All rights reserved.

Redistribution and use in source and binary forms, with or without
modification, are permitted provided that the following conditions are met:

    * Redistributions of source code must retain the above copyright
      notice, this list of conditions and the following disclaimer.
    * Redistributions in binary form must reproduce the above copyright
      notice, this list of conditions and the following disclaimer in the
      documentation and/or other materials provided with the distribution.
    * None of the names of the contributors may be used to endorse or promote
      products derived from this software without specific prior written
      permission.

THIS SOFTWARE IS PROVIDED BY THE COPYRIGHT HOLDERS AND CONTRIBUTORS "AS IS" AND
ANY EXPRESS OR IMPLIED WARRANTIES, INCLUDING, BUT NOT LIMITED TO, THE IMPLIED
WARRANTIES OF MERCHANTABILITY AND FITNESS FOR A PARTICULAR PURPOSE ARE
DISCLAIMED. IN NO EVENT SHALL THE COPYRIGHT HOLDERS BE LIABLE FOR ANY
DIRECT, INDIRECT, INCIDENTAL, SPECIAL, EXEMPLARY, OR CONSEQUENTIAL DAMAGES
(INCLUDING, BUT NOT LIMITED TO, PROCUREMENT OF SUBSTITUTE GOODS OR SERVICES;
LOSS OF USE, DATA, OR PROFITS; OR BUSINESS INTERRUPTION) HOWEVER CAUSED AND
ON ANY THEORY OF LIABILITY, WHETHER IN CONTRACT, STRICT LIABILITY, OR TORT
(INCLUDING NEGLIGENCE OR OTHERWISE) ARISING IN ANY WAY OUT OF THE USE OF THIS
SOFTWARE, EVEN IF ADVISED OF THE POSSIBILITY OF SUCH DAMAGE.
'''


def fields(data):
    """The arrays of a Mitsuba tensor file: 'tensor_file\\0', version, count; name, rank, type,
    offset, shape of each."""
    import struct

    import numpy
    assert data[:12] == b'tensor_file\0'
    (count,), at, out = struct.unpack_from('<I', data, 14), 18, {}
    for _ in range(count):
        (length,) = struct.unpack_from('<H', data, at)
        name = data[at + 2:at + 2 + length].decode()
        at += 2 + length
        rank, kind, offset = struct.unpack_from('<HBQ', data, at)
        shape = struct.unpack_from('<%dQ' % rank, data, at + 11)
        at += 11 + 8 * rank
        out[name] = numpy.frombuffer(data, '<f8', int(numpy.prod(shape)), offset).reshape(shape)
    return out


def make(source, target):
    import struct
    found = fields(open(source, 'rb').read())
    with open(target, 'w', encoding='ascii') as file:
        for line in LICENCE.splitlines():
            file.write(('# ' + line).rstrip() + '\n')
        for key, (_, shape) in TABLES.items():
            assert found[key].shape == shape, key
            file.write(key + '\n')
            for row in found[key].reshape(-1, shape[-1]):
                texts = []
                for x in row:
                    single = struct.unpack('f', struct.pack('f', x))[0]
                    texts.append(next(t for t in ('%.*g' % (n, x) for n in range(1, 10))
                                      if struct.unpack('f', struct.pack('f', float(t)))[0] == single))
                file.write(' '.join(texts) + '\n')


def embed(source, target):
    numbers, key = {}, None
    for line in open(source, encoding='ascii'):
        if line.startswith('#'):
            continue
        if line.strip() in TABLES:
            key = line.strip()
            numbers[key] = []
        else:
            numbers[key] += line.split()
    with open(target, 'w', encoding='ascii') as file:
        file.write('#include "kind/emitter/skylight.h"\n')
        for key, (name, shape) in TABLES.items():
            values = [t if '.' in t or 'e' in t else t + '.' for t in numbers[key]]
            assert len(values) == math.prod(shape), key

            def block(first, dims):
                if not dims:
                    return values[first] + 'f'
                step = math.prod(dims[1:])
                return '{' + ','.join(block(first + k * step, dims[1:]) for k in range(dims[0])) + '}\n'
            file.write('const float %s%s =\n%s;\n' % (name, ''.join('[%d]' % n for n in shape), block(0, shape)))


{'make': make, 'embed': embed}[sys.argv[1]](sys.argv[2], sys.argv[3])
