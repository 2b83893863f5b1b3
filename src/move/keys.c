/* SPDX-License-Identifier: Apache-2.0
 *
 * Velocities of an instance that moves in time, by its two places (moves.h). With R_0, R_1 its rotations and
 * x_0, x_1 its translations, w the vector of rotation of R_1 R_0^T and s the part of its way, it is at
 *
 *     R = exp(s w) R_0,    x = (1 - s) x_0 + s x_1
 *
 * A place k that is shifted by e_k and turned by a_k about c_k changes
 *
 *     x_k' = e_k + a_k x (x_k - c_k),    J(w) w' = a_1 - exp(w) a_0
 *
 * so that the instance, of whose maps the stretch stays, turns about x by
 *
 *     a = exp(s w) a_0 + s J(s w) w',    J(w) = int_0^1 exp(u w) du
 *
 * which commute: all are functions of the one skew matrix [w] = w x. */
#include "moves.h"
#include <complex.h>

/* On vectors across w such a function of [w] is a complex number f(i |w|), turning about w; on w itself f(0). */
struct turning {
    imp_v3 axis; /* unit; 0: w is 0, and the function the number `along` */
    double complex across;
    double along;
};

static imp_v3 turn_by(const struct turning *f, imp_v3 v, bool transposed)
{
    const imp_v3 along = f->axis * imp__dot(f->axis, v), across = v - along;
    const double im = transposed ? -cimag(f->across) : cimag(f->across);
    return along * f->along + across * creal(f->across) +
           imp__cross(f->axis, across) * im;
}

/* J at the angle t: (exp(i t) - 1)/(i t). */
static double complex mean_turn(double t)
{
    if (fabs(t) < 1e-4) return 1 - t * t / 6 + I * (t / 2);
    return (cexp(I * t) - 1) / (I * t);
}

/* What the two places are to `a` at the part s of the way: of the first  exp(s w) - K exp(w),  of the last
 * K = s J(s w)/J(w). */
static struct turning turning_of(const struct imp_motion *motion, int key, double s)
{
    const imp_v3 w = imp__motion_rotation(motion);
    const double t = imp__length(w);
    const double complex last = s * mean_turn(s * t) / mean_turn(t);
    return (struct turning){.axis = t > 0 ? w * (1 / t) : (imp_v3){0},
                            .across = key ? last : cexp(I * (s * t)) - last * cexp(I * t),
                            .along = key ? s : 1 - s};
}

static const struct imp_motion *motion_of(const struct imp__moves *moves,
                                          const struct imp__mover *m)
{
    return moves->scene->world->instance[m->shape - IMP_MOVE_INSTANCE(0)].motion;
}

static imp_v3 middle_of(const struct imp_motion *motion, double s)
{
    return motion->shift[0] * (1 - s) + motion->shift[1] * s;
}

struct imp__turned imp__key_turned(const struct imp__moves *moves,
                                   const struct imp__mover *m, double time,
                                   const double *theta)
{
    const struct imp_motion *motion = motion_of(moves, m);
    const double s = imp__motion_part(motion, time);
    struct imp__turned out = {.c = middle_of(motion, s)};
    if (!theta) return out;
    const struct turning f = turning_of(motion, m->key, s);
    const imp_v3 e = imp__move_vector(theta), a = imp__move_vector(theta + 3);
    out.a = turn_by(&f, a, false);
    out.e = (e + imp__cross(a, motion->shift[m->key] - m->centre)) * (m->key ? s : 1 - s);
    return out;
}

void imp__key_turned_bar(const struct imp__moves *moves, const struct imp__mover *m,
                         double time, imp_v3 e_bar, imp_v3 a_bar, double *theta_bar)
{
    const struct imp_motion *motion = motion_of(moves, m);
    const double s = imp__motion_part(motion, time);
    const struct turning f = turning_of(motion, m->key, s);
    e_bar *= m->key ? s : 1 - s;
    imp__move_vector_bar(theta_bar, e_bar);
    imp__move_vector_bar(theta_bar + 3,
                         turn_by(&f, a_bar, true) +
                             imp__cross(motion->shift[m->key] - m->centre, e_bar));
}
