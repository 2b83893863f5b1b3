/* SPDX-License-Identifier: Apache-2.0
 *
 * Affine maps, their inverses and products, and motions between two maps: polar decomposition by
 * Newton's iteration, rotation by quaternions, bounds of a moving box. */
#include "motion.h"
#include <string.h>

struct imp_map imp__map_of(const struct imp_mat4 *a)
{
    struct imp_map map;
    memcpy(map.m, a->m, sizeof map.m);
    return map;
}

bool imp__map_inverse(const struct imp_map *a, struct imp_map *out)
{
    struct imp_mat4 m = imp__mat4_identity(), inverse;
    memcpy(m.m, a->m, sizeof a->m);
    if (!imp__mat4_inverse(&m, &inverse)) return false;
    *out = imp__map_of(&inverse);
    return true;
}

struct imp_map imp__map_product(const struct imp_map *a, const struct imp_map *b)
{
    struct imp_map c;
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 4; j++)
            c.m[4 * i + j] = (a->m[4 * i] * b->m[j] + a->m[4 * i + 1] * b->m[4 + j]) +
                             (a->m[4 * i + 2] * b->m[8 + j] + (j == 3) * a->m[4 * i + 3]);
    return c;
}

void imp__map_box(const struct imp_map *a, imp_v3 *lo, imp_v3 *hi)
{
    const imp_v3 from[2] = {*lo, *hi};
    *lo = imp__v3(INFINITY, INFINITY, INFINITY);
    *hi = imp__v3(-INFINITY, -INFINITY, -INFINITY);
    for (int k = 0; k < 8; k++) {
        const imp_v3 p = imp__map_point(
            a, imp__v3(from[k & 1][0], from[k >> 1 & 1][1], from[k >> 2][2]));
        for (int i = 0; i < 3; i++) {
            (*lo)[i] = fmin((*lo)[i], p[i]);
            (*hi)[i] = fmax((*hi)[i], p[i]);
        }
    }
}

/* ---- Polar decomposition ---------------------------------------------------------- */

static double det3(const double a[9])
{
    return a[0] * (a[4] * a[8] - a[5] * a[7]) - a[1] * (a[3] * a[8] - a[5] * a[6]) +
           a[2] * (a[3] * a[7] - a[4] * a[6]);
}

/* Transpose of the inverse, from cofactors. */
static void contragredient(const double a[9], double out[9])
{
    const double r = 1 / det3(a);
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) {
            const int i1 = (i + 1) % 3, i2 = (i + 2) % 3, j1 = (j + 1) % 3,
                      j2 = (j + 2) % 3;
            out[3 * i + j] =
                r * (a[3 * i1 + j1] * a[3 * i2 + j2] - a[3 * i1 + j2] * a[3 * i2 + j1]);
        }
}

static double norm(const double a[9])
{
    double sum = 0;
    for (int k = 0; k < 9; k++) sum += a[k] * a[k];
    return sqrt(sum);
}

/* Newton's iteration for the orthogonal factor, with Higham's scaling: Q <- (g Q +
 * Q^-T / g) / 2 (Higham, SIAM J. Sci. Stat. Comput. 7, 1986). */
static void orthogonal_factor(const double a[9], double q[9])
{
    memcpy(q, a, 9 * sizeof *q);
    for (int step = 0; step < 100; step++) {
        double y[9], change = 0;
        contragredient(q, y);
        const double g = sqrt(norm(y) / norm(q));
        for (int k = 0; k < 9; k++) {
            const double next = 0.5 * (g * q[k] + y[k] / g);
            change = fmax(change, fabs(next - q[k]));
            q[k] = next;
        }
        if (change < 1e-15) break;
    }
}

/* Unit quaternion of a rotation matrix: the component of largest magnitude first (Shepperd, J.
 * Guidance and Control 1, 1978). */
static void quaternion(const double r[9], double out[4])
{
    const double trace = r[0] + r[4] + r[8];
    const double size[4] = {r[0], r[4], r[8], trace};
    int k = 0;
    for (int i = 1; i < 4; i++)
        if (size[i] > size[k]) k = i;
    if (k == 3) {
        out[0] = r[7] - r[5];
        out[1] = r[2] - r[6];
        out[2] = r[3] - r[1];
        out[3] = 1 + trace;
    } else {
        const int i = k, j = (k + 1) % 3, l = (k + 2) % 3;
        out[i] = 1 + r[4 * i] - r[4 * j] - r[4 * l];
        out[j] = r[3 * i + j] + r[3 * j + i];
        out[l] = r[3 * l + i] + r[3 * i + l];
        out[3] = r[3 * l + j] - r[3 * j + l];
    }
    double length = 0;
    for (int i = 0; i < 4; i++) length += out[i] * out[i];
    for (int i = 0; i < 4; i++) out[i] /= sqrt(length);
}

static void rotation(const double q[4], double r[9])
{
    const double x = q[0], y = q[1], z = q[2], w = q[3];
    const double all[9] = {
        1 - 2 * (y * y + z * z), 2 * (x * y - z * w),     2 * (x * z + y * w),
        2 * (x * y + z * w),     1 - 2 * (x * x + z * z), 2 * (y * z - x * w),
        2 * (x * z - y * w),     2 * (y * z + x * w),     1 - 2 * (x * x + y * y)};
    memcpy(r, all, sizeof all);
}

static void linear_part(const struct imp_map *a, double out[9])
{
    for (int k = 0; k < 9; k++) out[k] = a->m[k / 3 * 4 + k % 3];
}

static bool decompose(const struct imp_map *a, int side, struct imp_motion *m)
{
    struct imp_map inverse;
    double linear[9], q[9];
    if (!imp__map_inverse(a, &inverse)) return false;
    linear_part(a, linear);
    orthogonal_factor(linear, q);
    /* A mirroring map is a rotation of a stretch that mirrors all three axes. */
    const double hand = det3(linear) < 0 ? -1 : 1;
    for (int k = 0; k < 9; k++) q[k] *= hand;
    for (int i = 0; i < 3; i++) {
        for (int j = 0; j < 3; j++) {
            double sum = 0;
            for (int k = 0; k < 3; k++) sum += q[3 * k + i] * linear[3 * k + j];
            m->stretch[side][3 * i + j] = sum;
        }
        m->shift[side][i] = a->m[4 * i + 3];
    }
    m->shift[side][3] = 0;
    quaternion(q, m->turn[side]);
    return true;
}

static void short_way(struct imp_motion *m)
{
    double c = 0;
    for (int k = 0; k < 4; k++) c += m->turn[0][k] * m->turn[1][k];
    for (int k = 0; c < 0 && k < 4; k++) m->turn[1][k] = -m->turn[1][k];
    m->angle = 2 * acos(fmin(fabs(c), 1));
}

bool imp__motion_make(const struct imp_map *from, const struct imp_map *to, double start,
                      double end, struct imp_motion *out)
{
    struct imp_motion m = {.start = start, .end = end};
    double a[9], b[9];
    linear_part(from, a);
    linear_part(to, b);
    if ((det3(a) < 0) != (det3(b) < 0)) return false;
    if (!decompose(from, 0, &m) || !decompose(to, 1, &m)) return false;
    short_way(&m);
    *out = m;
    return true;
}

#define SAME 1e-9 /* stretches differ, per stretch */

bool imp__motion_is_rigid(const struct imp_motion *m)
{
    double most = 0;
    for (int k = 0; k < 9; k++)
        most = fmax(most, fabs(m->stretch[1][k] - m->stretch[0][k]));
    return most <= SAME * norm(m->stretch[0]);
}

/* a b, as rotations: b first. */
static void quaternion_product(const double a[4], const double b[4], double out[4])
{
    out[0] = a[3] * b[0] + a[0] * b[3] + a[1] * b[2] - a[2] * b[1];
    out[1] = a[3] * b[1] + a[1] * b[3] + a[2] * b[0] - a[0] * b[2];
    out[2] = a[3] * b[2] + a[2] * b[3] + a[0] * b[1] - a[1] * b[0];
    out[3] = a[3] * b[3] - a[0] * b[0] - a[1] * b[1] - a[2] * b[2];
}

void imp__motion_turn(struct imp_motion *m, int side, const double by[3], imp_v3 shift)
{
    const double angle = sqrt(by[0] * by[0] + by[1] * by[1] + by[2] * by[2]),
                 sine = angle > 0 ? sin(angle / 2) / angle : 0.5;
    const double turn[4] = {sine * by[0], sine * by[1], sine * by[2], cos(angle / 2)};
    const double old[4] = {m->turn[side][0], m->turn[side][1], m->turn[side][2],
                           m->turn[side][3]};
    quaternion_product(turn, old, m->turn[side]);
    m->shift[side] = shift;
    short_way(m);
}

imp_v3 imp__motion_rotation(const struct imp_motion *m)
{
    const double *a = m->turn[0], back[4] = {-a[0], -a[1], -a[2], a[3]};
    double q[4];
    quaternion_product(m->turn[1], back, q);
    const imp_v3 v = imp__v3(q[0], q[1], q[2]);
    const double sine = imp__length(v);
    return v * (sine > 1e-8 ? 2 * atan2(sine, q[3]) / sine : 2);
}

static struct imp_map map_at(const struct imp_motion *m, double x)
{
    struct imp_map map;
    double q[4], r[9], s[9];
    const double half = m->angle / 2, sine = sin(half);
    const double f0 = sine > 1e-8 ? sin((1 - x) * half) / sine : 1 - x;
    const double f1 = sine > 1e-8 ? sin(x * half) / sine : x;
    for (int k = 0; k < 4; k++) q[k] = f0 * m->turn[0][k] + f1 * m->turn[1][k];
    for (int k = 0; k < 9; k++) s[k] = (1 - x) * m->stretch[0][k] + x * m->stretch[1][k];
    rotation(q, r);
    for (int i = 0; i < 3; i++) {
        for (int j = 0; j < 3; j++)
            map.m[4 * i + j] =
                r[3 * i] * s[j] + r[3 * i + 1] * s[3 + j] + r[3 * i + 2] * s[6 + j];
        map.m[4 * i + 3] = (1 - x) * m->shift[0][i] + x * m->shift[1][i];
    }
    return map;
}

void imp__motion_at(const struct imp_motion *m, double time, struct imp_map *map,
                    struct imp_map *inverse)
{
    *map = map_at(m, imp__motion_part(m, time));
    imp__map_inverse(map, inverse); /* what lies between is not singular either */
}

/* Between two of n times, a point leaves the line through its places there by no more
 * than h^2/8 times its largest acceleration, |p''| <= angle^2 |S p| + 2 angle |S' p|. */
void imp__motion_box(const struct imp_motion *m, imp_v3 *lo, imp_v3 *hi)
{
    enum { N = 16 };
    imp_v3 most[2] = {imp__v3(INFINITY, INFINITY, INFINITY),
                      imp__v3(-INFINITY, -INFINITY, -INFINITY)};
    double reach = 0, change = 0;
    for (int k = 0; k < 8; k++) {
        const imp_v3 p = imp__v3((k & 1 ? *hi : *lo)[0], (k & 2 ? *hi : *lo)[1],
                                 (k & 4 ? *hi : *lo)[2]);
        imp_v3 s[2] = {{0}, {0}};
        for (int j = 0; j < 2; j++) {
            const double *a = m->stretch[j];
            for (int i = 0; i < 3; i++)
                s[j][i] = a[3 * i] * p[0] + a[3 * i + 1] * p[1] + a[3 * i + 2] * p[2];
            reach = fmax(reach, imp__length(s[j]));
        }
        change = fmax(change, imp__length(s[1] - s[0]));
    }
    const double away =
        (m->angle * m->angle * reach + 2 * m->angle * change) / (8. * N * N);
    for (int t = 0; t <= N; t++) {
        const struct imp_map at = map_at(m, (double)t / N);
        imp_v3 a = *lo, b = *hi;
        imp__map_box(&at, &a, &b);
        for (int i = 0; i < 3; i++) {
            most[0][i] = fmin(most[0][i], a[i] - away);
            most[1][i] = fmax(most[1][i], b[i] + away);
        }
    }
    for (int i = 0; i < 3; i++) {
        (*lo)[i] = most[0][i];
        (*hi)[i] = most[1][i];
    }
}
