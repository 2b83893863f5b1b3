/* SPDX-License-Identifier: Apache-2.0
 *
 * Affine motions (affine.h), among them those of a circular cylinder by its ends p_0, p_1 and its radius r:
 * with the axis a, length L and d = p_1' - p_0',
 *
 *     A = d a^T/L - a (P d)^T/L + (r'/r) P,   V(p_0) = p_0',   P = 1 - a a^T,
 *
 * which stretches it along its axis and turns it, about no axis but those across it. */
#include "affine.h"

static imp_v3 row(const double *A, int i)
{
    return imp__v3(A[3 * i], A[3 * i + 1], A[3 * i + 2]);
}
static imp_v3 times(const double *A, imp_v3 v)
{
    return imp__v3(imp__dot(row(A, 0), v), imp__dot(row(A, 1), v),
                   imp__dot(row(A, 2), v));
}
static imp_v3 transposed_times(const double *A, imp_v3 v)
{
    return row(A, 0) * v[0] + row(A, 1) * v[1] + row(A, 2) * v[2];
}
static void outer_add(double *A, imp_v3 a, imp_v3 b)
{
    for (int k = 0; k < 9; k++) A[k] += a[k / 3] * b[k % 3];
}

static imp_v3 normal_velocity(const double *A, imp_v3 n)
{
    const imp_v3 turned = transposed_times(A, n);
    return n * imp__dot(n, turned) - turned;
}
static void normal_bar(double *A_bar, imp_v3 n, imp_v3 bar)
{
    outer_add(A_bar, n, n * imp__dot(n, bar) - bar);
}

void imp__affine_velocity(const struct imp__glued *x, imp_v3 r, const double *number,
                          struct imp__velocity *out)
{
    const double *A = number + 3;
    out->v += imp__move_vector(number) + times(A, r);
    out->n += normal_velocity(A, x->n);
    out->shade += normal_velocity(A, x->shade);
    out->area += A[0] + A[4] + A[8] - imp__dot(x->n, times(A, x->n));
    out->turn += imp__dot(imp__cross(x->n, x->s), times(A, x->s));
}

void imp__affine_bar(const struct imp__glued *x, imp_v3 r,
                     const struct imp__velocity *bar, double *number_bar)
{
    double *A = number_bar + 3;
    imp__move_vector_bar(number_bar, bar->v);
    outer_add(A, bar->v, r);
    normal_bar(A, x->n, bar->n);
    if (x->smooth) normal_bar(A, x->shade, bar->shade);
    for (int k = 0; k < 9; k += 4) A[k] += bar->area;
    outer_add(A, x->n, x->n * -bar->area);
    outer_add(A, imp__cross(x->n, x->s), x->s * bar->turn);
}

void imp__ends_bar(const struct imp__tube *tube, imp_v3 c, enum imp_pose_kind kind,
                   double bar[IMP_AFFINE_NUMBERS])
{
    double *A = bar + 3;
    const imp_v3 a = tube->axis, e_bar = imp__move_vector(bar);
    outer_add(A, e_bar, c - tube->base); /* e = p_0' + A (c - p_0) */
    const imp_v3 back = transposed_times(A, a);
    const imp_v3 d_bar =
        (times(A, a) - back + a * imp__dot(a, back)) * (1 / tube->length);
    const double r_bar = (A[0] + A[4] + A[8] - imp__dot(a, times(A, a))) / tube->radius;
    for (int k = 0; k < IMP_AFFINE_NUMBERS; k++) bar[k] = 0;
    if (kind == IMP_POSE_RADIUS) bar[0] = r_bar;
    else imp__move_vector_bar(bar, kind == IMP_POSE_END_1 ? d_bar : e_bar - d_bar);
}
