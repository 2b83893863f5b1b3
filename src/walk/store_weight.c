/* SPDX-License-Identifier: Apache-2.0
 *
 * How far kept walks are from those that would be drawn now. The densities of a walk at
 * theta' over those at theta, that it was drawn with, are
 *
 *     w = prod over steps of  p(theta')/p(theta)  s(theta')/s(theta)
 *
 * one positive number a walk, and the effective sample size of n walks is
 * (sum w)^2/(n sum w^2) of n. It ranks draws: where it is below .8 a new draw is worth its
 * price. A direction that another density than the BSDF's drew counts 1, since the choice
 * of the density is part of the draw; so does a step whose survival a guide decided.
 *
 * The ratios of densities alone have the mean 1, as far as walks were drawn where the new
 * density is. A mean far below 1 says that they were not: then they count no more than it.
 *
 * A free flight has the density of its events, in the mean over the lanes of a walk
 * (lane_mis.h). Tentative collisions at which the extinction is now above their bound have
 * no density, nor have null collisions where the extinction was the bound: both are
 * counted, and such walks are refused.
 *
 * No sample shows that a variance is infinite. A step that is survived with probability q
 * adds to the second moment of the throughput the factor f'^2/(p^2 q); from materials a to
 * materials b these have the mean T_ab (0 where the walk leaves the scene), and the second
 * moment grows from step to step as the spectral radius of T. The first step at which
 * roulette plays in a walk is left out: it answers for the throughput of all before it. */
#include "step.h"
#include "store.h"
#include <string.h>

/* A bound that is reached is above its extinction by a few roundings (majorants.c). */
#define CERTAIN 1e-6

/* ---- Walks ----------------------------------------------------------------------- */

static int class_of(const struct imp_bsdf *b)
{
    return b && b->index >= 0 ? b->index % IMP_STORE_CLASSES : 0;
}

/* A vertex that is looked at. */
struct looked {
    const struct imp_bsdf *bsdf;
    const struct imp_carried *carried;
    imp_spec in[IMP_INPUTS_MAX];
    struct imp_dirs dirs;
};

static void look(const struct imp_densities *m, const struct imp_decision *d,
                 struct looked *v)
{
    const struct imp_shape *shape =
        d->scatterer == IMP_IN_MEDIUM ? NULL : m->scene->shapes[d->shape];
    const struct imp_texcoord at = {.uv = {d->uv[0], d->uv[1]},
                                    .p = imp__decided_v3(d->p),
                                    .carried = v->carried,
                                    .shape = shape};
    imp__evaluate_inputs(v->bsdf, shape, &at, v->in);
    const int of = v->bsdf->index;
    v->dirs = (struct imp_dirs){imp__decided_v3(d->wo), imp__decided_v3(d->wi), d->lobe,
                                of >= 0 ? m->wanted[of] : 0};
}

/* Density now over the density when the direction was drawn. */
static double density_ratio(const struct looked *v, const struct imp_decision *d)
{
    if (d->drawn != IMP_DENSITY_KERNEL || !(d->kernel > 0)) return 1;
    double p;
    if (imp_likely(!v->bsdf->shaped)) {
        p = v->bsdf->ops->pdf(v->bsdf, v->in, &v->dirs);
    } else {
        imp_spec lanes;
        imp__shaped_pdf(v->bsdf, v->carried, v->in, &v->dirs, &lanes);
        p = lanes[imp__waves_drew(v->carried)];
    }
    return p / (double)d->kernel;
}

/* Survival that roulette would decide now (scatter.c). */
static double survival_now(const struct imp_densities *m, const struct looked *v,
                           imp_spec factor, imp_spec beta, double eta, bool four)
{
    double q;
    if (m->integrator->photons) {
        imp_spec H;
        if (!v->bsdf->ops->directional_albedo ||
            !v->bsdf->ops->directional_albedo(v->bsdf, v->in, &v->dirs.wo, &H))
            H = factor;
        q = fmin(1, imp__max_used(H, four) * m->integrator->h);
    } else {
        q = fmin(imp__max_used(beta, four) * eta * eta, 0.95);
    }
    return fmax(q, m->survival);
}

/* T of the segment that follows, over its density, by lane. `v`: the vertex, evaluated; NULL:
 * nothing that was crossed is kept. */
static imp_spec crossed(const struct imp_decision *d, const struct imp_vertex *v)
{
    if (!v || !v->on) return imp__spec((double)d->passes);
    return v->scale * ((double)d->pdf * (double)d->survive);
}

/* Throughput as roulette sees it (scatter.c): in a lane, the first factor that is zero but
 * may have a derivative is another number. */
static imp_spec seen_by_roulette(imp_spec factor, bool four, int zeros[4])
{
    const double stand_in = fmax(imp__max_used(factor, four), 0.5);
    for (int c = 0; c < 4; c++)
        if (factor[c] == 0 && zeros[c]++ == 0) factor[c] = stand_in;
    return factor;
}

/* ---- Free flights ---------------------------------------------------------------- */

/* Tentative collisions whose factors are no densities now, or were drawn where a null
 * collision could not be. Alone in its track and without a colour, a collision has the
 * density 1/passes. */
static void collisions_look(const struct imp_scene *scene, const struct imp_vertex *v,
                            struct imp_moments *sum)
{
    const struct imp_track *track = v->on;
    const bool certain = track->n == 1 && fabs((double)v->d.passes - 1) < CERTAIN;
    for (int i = 0; i < track->n; i++) {
        const struct imp_event *e = &track->event[i];
        imp_spec in[IMP_INPUTS_MAX];
        if (e->kind != IMP_NULL_AT && e->kind != IMP_REAL_AT) continue;
        const imp_v3 p =
            imp__decided_v3(track->o) + imp__decided_v3(track->d) * (double)e->t;
        const imp_spec sigma =
            imp__extinction_at(scene->media[e->medium], p, v->carried, in);
        const double most = imp__max_used(sigma, v->carried != NULL) / (double)e->bound;
        const int of = e->medium % IMP_STORE_CLASSES;
        if (most > 1) sum->passed[of]++;
        else if (certain && most < 1 - 2 * CERTAIN) sum->certain[of]++;
    }
}

static double lanes_mean(imp_spec f, int n)
{
    double sum = 0;
    for (int c = 0; c < n; c++) sum += f[c];
    return sum / n;
}

/* Density now over density then of all flights of a walk, and of those that hang on it:
 * each the mean over the lanes (lane_mis.h). Of the latter, `passes` is the reciprocal. f:
 * of the way to the walk's start. */
static double flights_ratio(const struct imp_scene *scene, const struct imp_walk *walk,
                            int lanes, imp_spec f, struct imp_moments *sum)
{
    double ratio = 1, mean = lanes_mean(f, lanes);
    for (const struct imp_vertex *v = walk->first; v; v = v->next) {
        for (const struct imp_side *s = v->side; s; s = s->next)
            ratio *= flights_ratio(scene, &s->walk, lanes, f, sum);
        if (!v->on) continue;
        collisions_look(scene, v, sum);
        f *= imp__track_eval(scene, v->on, v->carried);
        const double next = lanes_mean(f, lanes);
        if (!(mean > 0) || !(next > 0)) return 0;
        ratio *= next / mean * (double)v->d.passes;
        mean = next;
    }
    return ratio;
}

/* w of the walk's own vertices, and its steps' share in the growth. `v`: the vertices,
 * evaluated, of a walk with tracks; else NULL. */
static double walk_weight(const struct imp_store *s, const struct imp_record *r,
                          const struct imp_densities *m, const struct imp_record_walk *k,
                          const struct imp_walk *walk, const struct imp_vertex *at,
                          struct imp_moments *sum)
{
    const struct imp_carried *carried = walk->waves ? &walk->waves->carried : NULL;
    const struct imp_scene *scene = m->scene;
    const bool rolls = s->roulette && m->weights && !m->integrator->absorbs;
    imp_spec beta = imp__spec(1);
    double w = 1, eta = 1, seen = 1;
    int zeros[4] = {0};
    bool settled = false; /* roulette's first step answers for all before it */
    bool any = false;
    for (uint32_t j = 0; j < k->n_vertices; j++) {
        const struct imp_decision *d = imp__record_vertex(r, k->first + j);
        const struct imp_vertex *here = at;
        struct looked v;
        if (at) at = at->next;
        v.carried = carried;
        v.bsdf = imp__decided_bsdf(scene, d);
        if (!d->goes_on) continue;
        const bool moved = v.bsdf && v.bsdf->index >= 0 && m->moved[v.bsdf->index];
        const bool own = rolls && j < k->n;
        if (own && !v.bsdf) beta *= crossed(d, here);
        if (!v.bsdf || (!moved && !own)) continue;
        look(m, d, &v);
        const double ratio = moved ? density_ratio(&v, d) : 1;
        any |= moved && d->drawn == IMP_DENSITY_KERNEL;
        seen *= ratio;
        w *= ratio;
        if (!own) continue;
        imp_spec f;
        imp__bsdf_eval(v.bsdf, carried, v.in, &v.dirs, &f);
        const imp_spec step = f * (1 / (double)d->pdf);
        beta *=
            seen_by_roulette(step * (1 / fmax(ratio, 1e-300)), carried != NULL, zeros);
        if (v.bsdf->ops->index_ratio && !v.bsdf->shaped)
            eta *= v.bsdf->ops->index_ratio(v.bsdf, v.in, &v.dirs);
        if (!(d->survive < 1)) {
            beta *= crossed(d, here);
            continue;
        }
        const double q = m->guided
                             ? (double)d->survive
                             : survival_now(m, &v, step, beta, eta, carried != NULL);
        w *= q / (double)d->survive;
        beta *= crossed(d, here) * (1 / q);
        const bool first = !settled;
        settled = true;
        if (first) continue;
        const int a = class_of(v.bsdf);
        const struct imp_bsdf *next =
            j + 1 < k->n
                ? imp__decided_bsdf(scene, imp__record_vertex(r, k->first + j + 1))
                : NULL;
        sum->steps[a]++;
        for (int c = 0; next && c < 4; c++)
            sum->growth[a][class_of(next)][c] += step[c] * step[c] / (double)d->survive;
    }
    if (any) {
        sum->moved++;
        sum->seen += seen;
    }
    return w;
}

enum imp_status
imp__store_moments(const struct imp_store *s, const struct imp_densities *d,
                   const struct imp_tracer *tracer, struct imp_arena *arena, size_t tile,
                   const float *mask, size_t every, struct imp_moments *sum)
{
    const struct imp_record *r = &s->records[tile];
    const int x0 = (int)(tile % (size_t)s->across) * IMP_STORE_SIDE - s->margin;
    const int y0 = (int)(tile / (size_t)s->across) * IMP_STORE_SIDE - s->margin;
    const int side = imp_min(IMP_STORE_SIDE, s->width + s->margin - x0);
    const bool tracks = s->roulette && d->weights && !d->guided;
    for (size_t i = 0; i < r->n_walks; i += every) {
        const struct imp_record_walk *k = imp__record_at(r, i);
        const int pixel = (int)(i / s->n);
        const int x = imp_clamp(x0 + pixel % side, 0, s->width - 1);
        const int y = imp_clamp(y0 + pixel / side, 0, s->height - 1);
        struct imp_walk walk = {.key = k->key};
        if (mask && !(mask[(size_t)y * (size_t)s->width + (size_t)x] > 0)) continue;
        const struct imp_arena_mark mark = imp__arena_mark(arena);
        if ((tracks || d->flights) && k->n_items > 0)
            imp__record_walk(r, i, tracer, arena, &walk);
        else if (tracer->wavelengths && !imp__walk_wave(tracer, arena, k->wave, &walk))
            return imp__error(s->ctx, IMP_E_NOMEM, "no memory for a walk");
        if (walk.dropped == IMP_DROP_MEMORY)
            return imp__error(s->ctx, IMP_E_NOMEM, "no memory for a walk");
        double w = walk_weight(s, r, d, k, &walk, walk.first, sum);
        if (d->flights)
            w *= flights_ratio(tracer->scene, &walk,
                               walk.waves ? walk.waves->carried.n
                                          : tracer->scene->channels,
                               imp__spec(1), sum);
        sum->n++;
        sum->w += w;
        sum->w2 += w * w;
        imp__arena_rewind(arena, mark);
    }
    return IMP_OK;
}

double imp__moments_radius(const struct imp_moments *sum)
{
    double most = 0;
    for (int c = 0; c < 4; c++) {
        double x[IMP_STORE_CLASSES], radius = 0;
        for (int a = 0; a < IMP_STORE_CLASSES; a++) x[a] = 1;
        for (int round = 0; round < 100; round++) { /* power iteration */
            double y[IMP_STORE_CLASSES], largest = 0;
            for (int a = 0; a < IMP_STORE_CLASSES; a++) {
                y[a] = 0;
                for (int b = 0; sum->steps[a] > 0 && b < IMP_STORE_CLASSES; b++)
                    y[a] += sum->growth[a][b][c] / sum->steps[a] * x[b];
                largest = fmax(largest, y[a]);
            }
            if (!(largest > 0)) {
                radius = 0;
                break;
            }
            /* Shifted, so that classes that take turns do not oscillate. */
            radius = largest;
            double norm = 0;
            for (int a = 0; a < IMP_STORE_CLASSES; a++) {
                x[a] = y[a] + 0.1 * largest * x[a];
                norm = fmax(norm, x[a]);
            }
            for (int a = 0; a < IMP_STORE_CLASSES; a++) x[a] /= norm;
        }
        most = fmax(most, radius);
    }
    return most;
}
