/* SPDX-License-Identifier: Apache-2.0
 *
 * Rays from the eye to a place over one ball, both outside of it (boundary_bent.c): it reflects them once, or
 * lets them in, reflects them inside m times, and lets them out. All of these lie in a plane with the ball's
 * centre, and keep their distance b from it outside, and b/n inside, n the index of the ball. With
 *
 *     sin i = b/R,  sin t = b/(n R),  sin alpha = b/D,  sin beta = b/d,
 *
 * of a ball of radius R, D and d away, a ray turns about the centre from the eye to the place by
 *
 *     Phi = 2 i - alpha - beta,  or  2 i - alpha - beta + (m + 1)(pi - 2 t).
 *
 * It is the angle between the two, or that and whole turns, either way round. As i rises, Phi has the slope
 *
 *     h = 2 - cos i [R/sqrt(D^2 - b^2) + R/sqrt(d^2 - b^2) + 2 (m + 1) R/sqrt(n^2 R^2 - b^2)],
 *
 * the last of these through glass alone. Where n > 1, and over the ball, each of them falls, so that Phi
 * has one minimum at most; where n < 1 the last one is above 2, and Phi falls. So all roots are bracketed.
 * The reflected one is Alhazen's. */
#include "bent_chain.h"
#include "math/warp.h"

/* What the angle depends on; lengths per radius of the ball. */
struct turn {
    double eye, place; /* distances; INFINITY: parallel rays, and directions */
    double index;      /* of glass; 0: it reflects */
    int inside;        /* m + 1 */
};

static double turned(const struct turn *x, double i)
{
    const double b = sin(i);
    double sum = 2 * i - asin(b / x->eye) - asin(b / x->place);
    if (x->index > 0) sum += x->inside * (IMP_PI - 2 * asin(imp_min(b / x->index, 1.0)));
    return sum;
}
static double turned_slope(const struct turn *x, double i)
{
    const double b = sin(i), b2 = b * b;
    double sum = 1 / sqrt(imp__sqr(x->eye) - b2) + 1 / sqrt(imp__sqr(x->place) - b2);
    if (x->index > 0) sum += 2 * x->inside / sqrt(imp__sqr(x->index) - b2);
    return 2 - cos(i) * sum;
}

#define BISECTIONS 60 /* at most: of Newton's method, which they keep in its bracket */

/* Where Phi, which rises or falls from lo to hi, is this. False: nowhere there. */
static bool turned_find(const struct turn *x, double lo, double hi, double to, double *at)
{
    const double first = turned(x, lo) - to, last = turned(x, hi) - to;
    if (!((first <= 0 && last > 0) || (first >= 0 && last < 0))) return false;
    const bool rises = last > 0;
    double i = 0.5 * (lo + hi);
    for (int k = 0; k < BISECTIONS; k++) {
        const double miss = turned(x, i) - to;
        if ((miss < 0) == rises) lo = i;
        else hi = i;
        const double next = i - miss / turned_slope(x, i), before = i;
        i = next > lo && next < hi ? next : 0.5 * (lo + hi);
        if (fabs(i - before) < 1e-15) break;
    }
    *at = i;
    return true;
}

/* Where Phi is least. */
static double turned_least(const struct turn *x, double hi)
{
    double lo = 0;
    if (x->index > 0 && x->index < 1) return hi; /* it falls */
    if (x->index == 0 || turned_slope(x, 0) >= 0) return 0;
    for (int k = 0; k < BISECTIONS; k++) {
        const double i = 0.5 * (lo + hi);
        if (turned_slope(x, i) < 0) lo = i;
        else hi = i;
    }
    return lo;
}

/* A root: the angle i, and which way round it goes. */
struct way {
    double i, side;
};
/* All of them, `angle` being that between the eye and the place; their number, `most` at most. */
static int ways_find(const struct turn *x, double angle, struct way *out, int most)
{
    const double end = x->index > 0 && x->index < 1 ? asin(x->index) : IMP_PI / 2,
                 least = turned_least(x, end), part[3] = {0, least, end};
    int n = 0;
    for (int k = 0; k < 2; k++) {
        if (!(part[k] < part[k + 1])) continue;
        const double highest = imp_max(turned(x, part[k]), turned(x, part[k + 1]));
        for (double whole = 0; whole - angle <= highest; whole += IMP_2PI)
            for (int side = -1; side <= 1; side += 2)
                if (n < most &&
                    turned_find(x, part[k], part[k + 1], whole + side * angle, &out[n].i))
                    out[n++].side = side;
    }
    return n;
}

bool imp__round_chain(const struct imp__edge_draw *d, const struct imp__bent_goal *goal,
                      const struct imp__bent_chain *c)
{
    const struct imp__bent_surface *first = &c->at[0];
    if (c->n == 0 || goal->radius > 0 || !(first->radius > 0) || first->inside ||
        !imp__is_zero(first->axis))
        return false;
    const double near = d->b->parallel ? INFINITY : imp__length(d->eye - first->p);
    if (!(near > first->radius) ||
        (!goal->far && !(imp__length(goal->p - first->p) > first->radius)))
        return false;
    if (first->ratio == 0) return c->n == 1;
    for (int k = 1; k < c->n; k++) {
        const struct imp__bent_surface *s = &c->at[k];
        if (s->shape != first->shape || s->place != first->place || !s->inside ||
            (s->ratio > 0) != (k == c->n - 1))
            return false;
    }
    return c->n >= 2;
}

enum { WHICH_BALL, WHICH_WAY, WHICH_ROOT };
#define REFLECTED 0.25 /* of glass */
#define WAYS      (4 * IMP_SIGHT_MAX)

static void chain_set(const struct imp__bender *ball, int inside,
                      struct imp__bent_chain *out)
{
    const struct imp__bent_surface s = {.p = ball->round.centre,
                                        .radius = ball->round.radius,
                                        .shape = ball->shape,
                                        .place = ball->place};
    out->n = 1 + inside;
    for (int k = 0; k < out->n; k++) {
        out->at[k] = s;
        out->at[k].inside = k > 0;
    }
    if (inside == 0) return;
    out->at[0].ratio = 1 / ball->index;
    out->at[inside].ratio = ball->index;
}

bool imp__round_draw(const struct imp__edge_draw *d, struct imp_key key,
                     const struct imp__bent_goal *goal, struct imp__bent_root *x,
                     double *draws)
{
    const struct imp__boundary *b = d->b;
    const int depth = b->tracer->integrator->max_depth,
              longest = depth < 0 ? IMP_SIGHT_MAX : imp_min(depth - 1, IMP_SIGHT_MAX);
    const double which = imp__u01(key, WHICH_BALL) * (double)b->n_balls;
    const struct imp__bender *ball = &b->bender[imp_min((size_t)which, b->n_balls - 1)];
    const double R = ball->round.radius, u = imp__u01(key, WHICH_WAY);
    const imp_v3 p = goal->far ? goal->across : goal->p - ball->round.centre,
                 e = b->parallel ? -d->eye : d->eye - ball->round.centre;
    struct turn turn = {.eye = b->parallel ? INFINITY : imp__length(e) / R,
                        .place = goal->far ? INFINITY : imp__length(p) / R};
    double chance = 1 / (double)b->n_balls;
    if (goal->radius > 0 || longest < 1 || !(turn.eye > 1) || !(turn.place > 1))
        return false;
    if (ball->index > 0 && longest >= 2) {
        chance *= u < REFLECTED ? REFLECTED : 1 - REFLECTED;
        if (u >= REFLECTED) {
            turn.index = ball->index;
            turn.inside = 1 + imp__inside_draw((u - REFLECTED) / (1 - REFLECTED),
                                               longest - 2, &chance);
        }
    }
    const imp_v3 towards = imp__normalize(e), normal = imp__cross(towards, p);
    const double angle = atan2(imp__length(normal), imp__dot(towards, p));
    if (!(imp__length(normal) > 0)) return false; /* it is a root in each plane */
    const imp_v3 across = imp__cross(imp__normalize(normal), towards);
    struct way way[WAYS];
    const int n = ways_find(&turn, angle, way, WAYS);
    if (n == 0) return false;
    const struct way *w = &way[imp_min((int)(imp__u01(key, WHICH_ROOT) * n), n - 1)];
    const double away = sin(w->i) * w->side;
    if (b->parallel)
        x->from = ball->round.centre + towards * (2 * b->size) + across * (away * R);
    else {
        const double sine = away / turn.eye;
        x->from = across * sine - towards * sqrt(1 - sine * sine);
    }
    chain_set(ball, turn.inside, &x->chain);
    *draws = n / chance;
    return imp__bent_find(d, goal, x);
}
