/* SPDX-License-Identifier: Apache-2.0
 *
 * 4x4 matrices: determinant, inverse, and the elementary transforms of a scene file. */
#include "transform.h"

double imp__mat4_det3(const struct imp_mat4 *a)
{
    const double *m = a->m;
    return m[0] * (m[5] * m[10] - m[6] * m[9]) - m[1] * (m[4] * m[10] - m[6] * m[8]) +
           m[2] * (m[4] * m[9] - m[5] * m[8]);
}

/* Gauss-Jordan with row pivoting. A pivot is zero when it is lost in the rounding of the
 * row it came from, so maps of any scale are inverted and flat ones are refused. */
bool imp__mat4_inverse(const struct imp_mat4 *a, struct imp_mat4 *out)
{
    double m[4][8], size[4];
    for (int i = 0; i < 4; i++) {
        size[i] = 0;
        for (int j = 0; j < 4; j++) {
            m[i][j] = a->m[4 * i + j];
            m[i][j + 4] = i == j;
            if (!isfinite(m[i][j])) return false;
            if (j < 3) size[i] = fmax(size[i], fabs(m[i][j]));
        }
        size[i] = fmax(size[i], i == 3 ? fabs(m[i][3]) : 0);
        if (size[i] == 0) return false;
    }
    for (int k = 0; k < 4; k++) {
        int p = k;
        for (int i = k + 1; i < 4; i++)
            if (fabs(m[i][k]) / size[i] > fabs(m[p][k]) / size[p]) p = i;
        if (!(fabs(m[p][k]) > 1e-15 * size[p])) return false;
        for (int j = 0; p != k && j < 8; j++) {
            const double t = m[k][j];
            m[k][j] = m[p][j];
            m[p][j] = t;
        }
        const double s = size[k];
        size[k] = size[p];
        size[p] = s;
        const double r = 1 / m[k][k];
        for (int j = 0; j < 8; j++) m[k][j] *= r;
        for (int i = 0; i < 4; i++) {
            const double f = m[i][k];
            for (int j = 0; i != k && f != 0 && j < 8; j++) m[i][j] -= f * m[k][j];
        }
    }
    struct imp_mat4 inverse;
    for (int i = 0; i < 16; i++) inverse.m[i] = m[i / 4][4 + i % 4];
    if (!imp__mat4_is_finite(&inverse)) return false;
    *out = inverse;
    return true;
}

struct imp_mat4 imp__translate(imp_v3 t)
{
    return (struct imp_mat4){{1, 0, 0, t[0], 0, 1, 0, t[1], 0, 0, 1, t[2], 0, 0, 0, 1}};
}

struct imp_mat4 imp__scale(imp_v3 s)
{
    return (struct imp_mat4){{s[0], 0, 0, 0, 0, s[1], 0, 0, 0, 0, s[2], 0, 0, 0, 0, 1}};
}

/* Quarter turns are exact, so axis-aligned scenes stay axis-aligned. */
struct imp_mat4 imp__rotate(imp_v3 n, double degrees)
{
    const double turn = remainder(degrees, 360);
    double s = sin(turn * (IMP_PI / 180)), c = cos(turn * (IMP_PI / 180));
    if (fabs(turn) == 90) c = 0, s = copysign(1, turn);
    if (fabs(turn) == 180) c = -1, s = 0;
    const double k = 1 - c;
    return (struct imp_mat4){{c + k * n[0] * n[0], k * n[0] * n[1] - s * n[2],
                              k * n[0] * n[2] + s * n[1], 0, k * n[1] * n[0] + s * n[2],
                              c + k * n[1] * n[1], k * n[1] * n[2] - s * n[0], 0,
                              k * n[2] * n[0] - s * n[1], k * n[2] * n[1] + s * n[0],
                              c + k * n[2] * n[2], 0, 0, 0, 0, 1}};
}

bool imp__lookat(imp_v3 origin, imp_v3 target, imp_v3 up, struct imp_mat4 *out)
{
    const double distance = imp__length(target - origin);
    if (!(distance > 0) || !isfinite(distance)) return false;
    const imp_v3 dir = (target - origin) * (1 / distance);
    double length = imp__length(up);
    if (!isfinite(length)) return false;
    const imp_v3 u = length > 0 ? up * (1 / length) : imp__frame_from_normal(dir).s;
    imp_v3 left = imp__cross(u, dir);
    length = imp__length(left);
    if (!(length > 1e-12)) return false;
    left = left * (1 / length);
    const imp_v3 newup = imp__cross(dir, left);
    struct imp_mat4 m = imp__mat4_identity();
    for (int i = 0; i < 3; i++) {
        m.m[4 * i] = left[i];
        m.m[4 * i + 1] = newup[i];
        m.m[4 * i + 2] = dir[i];
        m.m[4 * i + 3] = origin[i];
    }
    if (!imp__mat4_is_finite(&m)) return false;
    *out = m;
    return true;
}
