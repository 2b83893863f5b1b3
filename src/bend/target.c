/* SPDX-License-Identifier: Apache-2.0
 *
 * Targets: value, and cotangents of the rays' arrivals (docs/bent-rays.md 4). Means are
 * weighted by the shares of power w_i p_i. */
#include "bend_problem.h"

/* Weight of an arrival by the cosine c between ray and normal of the plane: 0 below 0.05,
 * 1 above 0.15, smooth between (docs/bent-rays.md 2.6 b). */
static double slant_weight(double c, double *slope)
{
    const double t = imp_clamp((c - 0.05) / 0.1, 0.0, 1.0);
    *slope = 6 * t * (1 - t) / 0.1;
    return t * t * (3 - 2 * t);
}

bool imp__arrive(const struct imp_bend_target *t, const struct imp_bend_exit *e,
                 struct imp__arrival *a)
{
    if (e->flags & (IMP_BEND_DROPPED | IMP_BEND_TAP_MISSED)) return false;
    a->x = imp__v3_load(e->x);
    a->v = imp__v3_load(e->v);
    const double speed = imp__length(a->v);
    a->d = a->v * (1 / speed);
    a->path = e->path;
    a->weight = 1;
    a->s = a->slope = 0;
    if (!t->at_plane) return true;
    const imp_v3 n = imp__v3_load(t->normal);
    const double nv = imp__dot(n, a->v);
    a->weight = slant_weight(nv / speed,
                             &a->slope); /* 0 for rays that move away from the plane */
    if (a->weight == 0) return false;
    a->s = (t->offset - imp__dot(n, a->x)) / nv;
    a->x += a->s * a->v;
    a->path += a->s * t->outside * t->outside;
    return true;
}

/* s = (p - n.x)/(n.v): ds/dx = -n/(n.v), ds/dv = -s n/(n.v). */
void imp__arrive_vjp(const struct imp_bend_target *t, const struct imp__arrival *a,
                     imp_v3 x_bar, imp_v3 d_bar, imp_v3 v_bar, double path_bar,
                     double weight_bar, struct imp_bend_cotangent *bar)
{
    const double speed = imp__length(a->v);
    imp_v3 cx = x_bar, cv = v_bar + (d_bar - a->d * imp__dot(a->d, d_bar)) * (1 / speed);
    if (t->at_plane) {
        const imp_v3 n = imp__v3_load(t->normal);
        const double nv = imp__dot(n, a->v);
        const double s_bar = imp__dot(x_bar, a->v) + path_bar * t->outside * t->outside;
        cx -= n * (s_bar / nv);
        cv += a->s * x_bar - n * (a->s * s_bar / nv);
        const double c = nv / speed, c_bar = weight_bar * a->slope;
        cv += (n - a->d * c) * (c_bar / speed);
    }
    for (int k = 0; k < 3; k++) bar->x[k] += cx[k], bar->v[k] += cv[k];
    bar->path += path_bar;
}

/* ---- Targets ray by ray: f and its gradients ----------------------------------- */

struct part {
    double f;
    imp_v3 x, d, v;
    double path;
};

static void part_of(const imp_bend *b, const struct imp__target_of_rays *t, size_t i,
                    const struct imp__arrival *a, imp_v3 centre, double mean_path,
                    struct part *p)
{
    const struct imp_bend_target *desc = &t->desc;
    const size_t own = i - t->first;
    imp_v3 r;
    *p = (struct part){0};
    switch (desc->type) {
    case IMP_BEND_FOCUS:
    case IMP_BEND_SPOT:
    case IMP_BEND_POINTS:
        r = a->x -
            (desc->type == IMP_BEND_POINTS ? imp__v3_load(t->data + 3 * own) : centre);
        p->f = imp__dot(r, r) / 2;
        p->x = r;
        break;
    case IMP_BEND_DIRECTION:
    case IMP_BEND_DIRECTIONS:
        r = desc->type == IMP_BEND_DIRECTIONS ? imp__v3_load(t->data + 3 * own) : centre;
        r = a->d - imp__normalize(r);
        p->f = imp__dot(r, r) / 2;
        p->d = r;
        break;
    case IMP_BEND_DEFLECTION: { /* P v0 = 0: the change of v across d0 is P v */
        const imp_v3 d0 = imp__normalize(imp__v3_load(b->d[i]));
        r = a->v - d0 * imp__dot(d0, a->v) - imp__v3_load(t->data + 3 * own);
        p->f = imp__dot(r, r) / 2;
        p->v = r - d0 * imp__dot(d0, r);
        break;
    }
    case IMP_BEND_PATH:
    case IMP_BEND_WAVEFRONT: {
        const double s =
            a->path - (desc->type == IMP_BEND_PATH ? t->data[own] : mean_path);
        p->f = s * s / 2;
        p->path = s;
        break;
    }
    case IMP_BEND_SHAPE: {
        struct imp__jet j;
        imp__field_eval1(desc->sdf, &a->x, 1, &j);
        p->f = j.eta * j.eta / 2;
        p->x = j.eta * j.g;
        break;
    }
    case IMP_BEND_IMAGE:
    case IMP_BEND_FARFIELD: break;
    }
}

enum imp_status imp__target_value(const imp_bend *b, const struct imp__target_of_rays *t,
                                  const struct imp_bend_exit *exits,
                                  const struct imp_bend_exit *taps, double *value,
                                  struct imp_bend_cotangent *bars,
                                  struct imp_bend_cotangent *tap_bars)
{
    const struct imp_bend_target *desc = &t->desc;
    const size_t n_taps = b->options.n_taps;
    struct imp__arrival a;
    if (desc->type == IMP_BEND_IMAGE || desc->type == IMP_BEND_FARFIELD)
        return imp__image_value(b, t, exits, taps, value, bars, tap_bars, NULL);

    imp_v3 centre = imp__v3_load(desc->point);
    double mean_path = 0;
    if (desc->type == IMP_BEND_SPOT || desc->type == IMP_BEND_WAVEFRONT) {
        imp_v3 sum = {0};
        double weight = 0;
        for (size_t i = t->first; i < t->last; i++) {
            if (!imp__arrive(desc, imp__target_exit(desc, exits, taps, n_taps, i), &a))
                continue;
            const double share = a.weight * b->power[i];
            sum += share * a.x;
            mean_path += share * a.path;
            weight += share;
        }
        if (weight > 0) sum *= 1 / weight, mean_path /= weight;
        centre = sum; /* its derivative drops out: residuals about a mean sum to 0 */
    }
    double total = 0;
    const double scale = desc->weight / t->power;
    for (size_t i = t->first; i < t->last; i++) {
        struct part p;
        if (!imp__arrive(desc, imp__target_exit(desc, exits, taps, n_taps, i), &a))
            continue;
        part_of(b, t, i, &a, centre, mean_path, &p);
        const double share = scale * b->power[i], k = share * a.weight;
        total += k * p.f;
        if (!bars) continue;
        imp__arrive_vjp(desc, &a, k * p.x, k * p.d, k * p.v, k * p.path, share * p.f,
                        desc->tap < 0 ? &bars[i]
                                      : &tap_bars[i * n_taps + (size_t)desc->tap]);
    }
    *value = total;
    return IMP_OK;
}
