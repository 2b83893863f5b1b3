#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
#
#     tools/rgb_basis.py src/color/cie.c >src/color/rgb_basis.c
#
# Makes the three spectra that a linear basis of colours consists of, as Mallett and Yuksel ("Spectral Primary
# Decomposition for Rendering with sRGB Reflectance", 2019) define them: the smoothest (least sum of squared
# differences of neighbours) that are nowhere negative, sum to 1, and have the colours (1,0,0), (0,1,0), (0,0,1) under
# daylight. Needs numpy and scipy, and only to make the table again.
import re
import sys

import numpy as np
from scipy.optimize import nnls

N = 95
text = re.sub(r'/\*.*?\*/', '', open(sys.argv[1]).read(), flags=re.S)
blocks = [b.replace(',', ' ').split() for b in re.findall(r'\{([^{}]*)\}', text)]
X, Y, Z, D = [np.array([float(v) for v in b]) for b in blocks if len(b) == N]
M = np.array([[3.240479, -1.537150, -0.498535], [-0.969256, 1.875991, 0.041556], [0.055648, -0.204043, 1.057311]])

# Weights of the points in a colour, as src/color/upsample.c integrates: Simpson's rule over half steps, all that is
# between points linear; each channel is scaled so that white is 1.
fine = np.arange(2 * N - 1) / 2
simpson = np.where(np.arange(2 * N - 1) % 2 == 1, 4.0, 2.0)
simpson[[0, -1]] = 1
half = lambda t: np.interp(fine, np.arange(N), t)
dense = M @ np.array([half(c) * half(D) * simpson for c in (X, Y, Z)])
hats = np.array([np.interp(fine, np.arange(N), np.eye(N)[k]) for k in range(N)])
weight = dense @ hats.T
weight /= weight.sum(axis=1, keepdims=True)

# min |C x|^2 with A x = b, x >= 0: a great weight on A finds what is 0, then the rest is solved exactly.
A = np.zeros((N + 9, 3 * N))
b = np.zeros(N + 9)
for k in range(N):
    A[k, k::N] = b[k] = 1
for q in range(3):
    for c in range(3):
        A[N + 3 * q + c, q * N:(q + 1) * N] = weight[c]
        b[N + 3 * q + c] = q == c
A, b = A[:-1], b[:-1]  # the last follows from the others
step = np.diff(np.eye(N), axis=0)
C = np.kron(np.eye(3), step)
x, _ = nnls(np.vstack([C, 1e5 * A]), np.concatenate([np.zeros(len(C)), 1e5 * b]), maxiter=100000)
free = x > 1e-7
for _ in range(50):
    K = np.block([[C[:, free].T @ C[:, free], A[:, free].T], [A[:, free], np.zeros((len(b), len(b)))]])
    y = np.linalg.lstsq(K, np.concatenate([np.zeros(free.sum()), b]), rcond=1e-13)[0][:free.sum()]
    x = np.zeros(3 * N)
    x[free] = y
    if y.min() >= 0:
        break
    free &= x >= 0
basis = x.reshape(3, N)
assert basis.min() >= 0 and abs(basis.sum(axis=0) - 1).max() < 1e-9
assert abs(basis @ weight.T - np.eye(3)).max() < 1e-9

print('''/* SPDX-License-Identifier: Apache-2.0
 *
 * Made by tools/rgb_basis.py: a linear basis of colours, after Mallett and Yuksel,
 * "Spectral Primary Decomposition for Rendering with sRGB Reflectance", 2019. */
#include "rgb_basis.h"

/* clang-format off */
const double imp__rgb_basis_table[3][IMP_CIE_N] = {''')
for row in basis:
    text = ['%.12g' % v for v in row]
    lines, line = [], '       '
    for t in text:
        if len(line) + len(t) > 88:
            lines.append(line)
            line = '       '
        line += ' ' + t + ','
    print('    {\n' + '\n'.join(lines + [line]) + '\n    },')
print('};\n/* clang-format on */')
