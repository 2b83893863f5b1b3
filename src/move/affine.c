/* SPDX-License-Identifier: Apache-2.0
 *
 * Affine motions (affine.h), among them those of a circular cylinder by its ends p_0, p_1 and its radius r:
 * with the axis a, length L and d = p_1' - p_0',
 *
 *     A = d a^T/L - a (P d)^T/L + (r'/r) P,   V(p_0) = p_0',   P = 1 - a a^T,
 *
 * which stretches it along its axis and turns it, about no axis but those across it.
 *
 * By a map X = M x + t:  A = M' M^-1, e = t' + A (c - t), so that  dL/dM = (dL/dA + dL/de (c - t)^T) M^-T
 * and  dL/dt = dL/de.  A sphere, a
 * cylinder and a camera have only such A as keep their kind, and dL/dA is projected on these,
 *
 *     turns  (dL/dA - dL/dA^T)/2,   of a sphere also  1 tr(dL/dA)/3,
 *     of a cylinder also  a a^T (a.dL/dA a) + P (tr(dL/dA) - a.dL/dA a)/2,
 *
 * whose sum over the entries of any such A is the derivative. */
#include "affine.h"
#include "math/transform.h"

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

/* Vertex normals of a mesh turn each by itself; in an instance their sum does, which is linear in
 * them there. Weights of unit normals, by the length of the sum; the number of them. */
static int normals_of(const struct imp_scene *scene, const struct imp__glued *x,
                      imp_v3 n[3], double weight[3])
{
    if (x->place > 0) {
        n[0] = x->shade;
        weight[0] = 1;
        return 1;
    }
    const struct imp__corners f = imp__corners(scene, x->shape, x->prim, 0, x->time);
    for (int k = 0; k < 3; k++) {
        n[k] = f.n[k];
        weight[k] = x->b[k] / x->length;
    }
    return 3;
}

void imp__affine_velocity(const struct imp_scene *scene, const struct imp__glued *x,
                          imp_v3 r, const double *number, struct imp__velocity *out)
{
    const double *A = number + 3;
    out->v += imp__affine_place(r, number);
    out->n += normal_velocity(A, x->n);
    out->area += A[0] + A[4] + A[8] - imp__dot(x->n, times(A, x->n));
    out->turn += imp__dot(imp__cross(x->n, x->s), times(A, x->s));
    if (!x->smooth) {
        out->shade += normal_velocity(A, x->shade);
        return;
    }
    imp_v3 n[3], dot = {0};
    double weight[3];
    const int k_n = normals_of(scene, x, n, weight);
    for (int k = 0; k < k_n; k++) dot += normal_velocity(A, n[k]) * weight[k];
    out->shade += dot - x->shade * imp__dot(x->shade, dot);
}

void imp__affine_bar(const struct imp_scene *scene, const struct imp__glued *x, imp_v3 r,
                     const struct imp__velocity *bar, double *number_bar)
{
    double *A = number_bar + 3;
    imp__affine_place_bar(r, bar->v, number_bar);
    normal_bar(A, x->n, bar->n);
    for (int k = 0; k < 9; k += 4) A[k] += bar->area;
    outer_add(A, x->n, x->n * -bar->area);
    outer_add(A, imp__cross(x->n, x->s), x->s * bar->turn);
    if (!x->smooth) return;
    imp_v3 n[3];
    double weight[3];
    const int k_n = normals_of(scene, x, n, weight);
    const imp_v3 across = bar->shade - x->shade * imp__dot(x->shade, bar->shade);
    for (int k = 0; k < k_n; k++) normal_bar(A, n[k], across * weight[k]);
}

imp_v3 imp__affine_place(imp_v3 r, const double *number)
{
    return imp__move_vector(number) + times(number + 3, r);
}
void imp__affine_place_bar(imp_v3 r, imp_v3 bar, double *number_bar)
{
    imp__move_vector_bar(number_bar, bar);
    outer_add(number_bar + 3, bar, r);
}

/* A = [w]: A_21 - A_12 = 2 w_0. */
imp_v3 imp__affine_turn(const double *number)
{
    const double *A = number + 3;
    return imp__v3(0.5 * (A[7] - A[5]), 0.5 * (A[2] - A[6]), 0.5 * (A[3] - A[1]));
}
void imp__affine_turn_bar(imp_v3 turn_bar, double *number_bar)
{
    double *A = number_bar + 3;
    const imp_v3 half = turn_bar * 0.5;
    A[7] += half[0], A[5] -= half[0];
    A[2] += half[1], A[6] -= half[1];
    A[3] += half[2], A[1] -= half[2];
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

/* What of A_bar is of the kind that the object stays of. */
static void kind_keep(const struct imp_pose *pose, double *A)
{
    const struct imp_scene *scene = pose->scene;
    struct imp_round ball = {.radius = 0};
    struct imp__tube tube = {.radius = 0};
    const bool curved = pose->shape >= 0 && !imp__moves_disk(scene, pose->shape);
    const bool round = curved && imp__moves_sphere(scene, pose->shape, 0, &ball),
               long_one = curved && imp__moves_cylinder(scene, pose->shape, 0, &tube);
    /* Turned about its centre it is where it was, but for what is drawn on it. */
    const double turned =
        round && !imp__pose_looks_up(scene, scene->shapes[pose->shape]) ? 0 : 0.5;
    const imp_v3 a = tube.axis;
    const double trace = A[0] + A[4] + A[8], along = imp__dot(a, times(A, a));
    const double across = round ? trace / 3 : (trace - along) / 2;
    double out[9];
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) {
            out[3 * i + j] = turned * (A[3 * i + j] - A[3 * j + i]);
            if ((round || long_one) && i == j) out[3 * i + j] += across;
            if (long_one) out[3 * i + j] += a[i] * a[j] * (along - across);
        }
    for (int k = 0; k < 9; k++) A[k] = out[k];
}

void imp__world_bar(const struct imp_pose *pose, imp_v3 c, double bar[IMP_AFFINE_NUMBERS])
{
    const struct imp_mat4 M = imp__mat4_of_rows(pose->number);
    const imp_v3 e_bar = imp__move_vector(bar), t = imp__v3(M.m[3], M.m[7], M.m[11]);
    struct imp_mat4 back;
    double A[9];
    for (int k = 0; k < 9; k++) A[k] = bar[3 + k];
    outer_add(A, e_bar, c - t);
    if (!imp__mat4_inverse(&M, &back)) { /* no object is placed so */
        for (int k = 0; k < IMP_AFFINE_NUMBERS; k++) bar[k] = 0;
        return;
    }
    const bool is_flat =
        pose->shape >= 0 && pose->scene->shapes[pose->shape]->ops->flags & IMP_SHAPE_FLAT;
    if (!imp__world_is_free(pose)) kind_keep(pose, A);
    for (int i = 0; i < 3; i++) {
        for (int j = 0; j < 3; j++)
            bar[4 * i + j] = imp__dot(
                row(A, i), imp__v3(back.m[4 * j], back.m[4 * j + 1], back.m[4 * j + 2]));
        if (is_flat) bar[4 * i + 2] = 0; /* whatever its image of z is */
        bar[4 * i + 3] = e_bar[i];
    }
}
