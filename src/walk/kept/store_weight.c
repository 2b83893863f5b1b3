/* SPDX-License-Identifier: Apache-2.0
 *
 * How far recorded walks are from those that would be drawn now. The densities of a walk at
 * theta' over those at theta, that it was drawn with, are
 *
 *     w = prod over steps of  p(theta')/p(theta)  s(theta')/s(theta)
 *
 * one positive number a walk, and the effective sample size of n walks is
 * (sum w)^2/(n sum w^2) of n. It ranks draws: where it is below .8 a new draw is worth its
 * price. p is the density of what was drawn, whichever way: where guides and aims draw
 * directions beside the BSDF, with k its own density and r that of the others,
 *
 *     p(theta')/p(theta) = (share k' + r)/p(theta)
 *
 * since r is part of the draw. A step whose survival a guide decided counts 1.
 *
 * The ratios of densities alone have the mean 1, as far as walks were drawn where the new
 * density is. If the mean is far below 1 they were not, and count no more than it.
 *
 * Free flights, and directions that depend on the wavelength, have the density of all
 * that was decided so far, in the mean over the lanes of a walk (lane_mis.h), and
 * roulette sees the throughput that a fresh walk would have, over the present density.
 * With headroom a collision is real with another probability than its factor (flight.h), and
 * what counts is how the draw would decide now: walks in empty space, where nothing has
 * changed, are as good as they were, though their values differ.
 *
 * Tentative collisions at which the extinction is now above their bound have no density,
 * nor have null collisions where the extinction was the bound: both are counted, and such
 * walks are refused.
 *
 * No sample shows that a variance is infinite. A step that is survived with probability q
 * adds to the second moment of the throughput the factor f'^2/(p^2 q); from materials a to
 * materials b these have the mean T_ab (0 where the walk leaves the scene), and the second
 * moment grows from step to step as the spectral radius of T. The first step at which
 * roulette plays in a walk is left out: it answers for the throughput of all before it. */
#include "store.h"
#include "walk/core/step.h"
#include <string.h>

/* A bound that is reached is above its extinction by a few roundings (majorants.c). */
#define CERTAIN 1e-6
#define TINY    1e-300 /* a ratio that is 0 is no divisor */

/* ---- Walks ----------------------------------------------------------------------- */

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
                                    .shape = shape,
                                    .prim = d->located.prim};
    imp__evaluate_inputs(v->bsdf, shape, &at, v->in);
    const int of = v->bsdf->index;
    v->dirs = (struct imp_dirs){imp__decided_v3(d->wo), imp__decided_v3(d->wi), d->lobe,
                                of >= 0 ? m->wanted[of] : 0};
}

/* Survival that roulette would decide now (scatter.c). */
static double survival_now(const struct imp_densities *m, const struct looked *v,
                           imp_spec factor, imp_spec beta, double eta, bool four)
{
    double q;
    if (m->integrator->ends_by == IMP_ENDS_BY_ALBEDO) {
        imp_spec H;
        if (!v->bsdf->ops->directional_albedo ||
            !v->bsdf->ops->directional_albedo(v->bsdf, v->in, &v->dirs.wo, &H))
            H = factor;
        q = imp_min(imp__max_used(H, four) * m->integrator->h, 1.0);
    } else {
        q = imp_min(imp__max_used(beta, four) * eta * eta, 0.95);
    }
    return imp_max(q, m->survival);
}

/* Throughput as roulette sees it (scatter.c): in a lane, the first factor that is zero but
 * may have a derivative is another number. */
static imp_spec seen_by_roulette(imp_spec factor, bool four, int zeros[4])
{
    const double stand_in = imp_max(imp__max_used(factor, four), 0.5);
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

/* ---- One walk ---------------------------------------------------------------------- */

/* What a walk has been through. */
struct course {
    const struct imp_densities *m;
    const struct imp_record *record;
    const struct imp_carried *carried;
    struct imp_moments *sum;
    int lanes;
    bool rolls;
    bool own;      /* no branch of another walk */
    imp_spec p;    /* density of what lanes may decide otherwise, its mean is 1 */
    imp_spec beta; /* as roulette would see it now */
    double w, eta;
    double stratum_weight; /* so many walks */
    double seen;           /* ratio of its directions alone */
    int zeros[4];
    bool settled; /* roulette's first step answers for all before it */
    bool any;     /* a direction's density has changed */
};

/* Density now, over the decided one, of a decision that has the density p for each lane. */
static double lanes_ratio(struct course *c, imp_spec p, double decided)
{
    double sum = 0;
    c->p *= p;
    for (int k = 0; k < c->lanes; k++) sum += c->p[k];
    const double mean = sum / c->lanes;
    if (!(mean > 0)) return 0;
    c->p *= 1 / mean;
    return mean / decided;
}

static double direction_ratio(struct course *c, const struct looked *v,
                              const struct imp_decision *d)
{
    const double share = d->share, rest = d->rest, p = d->pdf;
    if (imp_likely(!v->bsdf->shaped))
        return (share * v->bsdf->ops->pdf(v->bsdf, v->in, &v->dirs) + rest) / p;
    imp_spec k;
    imp__shaped_pdf(v->bsdf, c->carried, v->in, &v->dirs, &k);
    if (d->alone) return (share * k[imp__waves_drew(c->carried)] + rest) / p;
    return lanes_ratio(c, share * k + rest, p);
}

/* The segment that follows; `v`: the vertex, evaluated, NULL: nothing that was crossed is
 * kept. */
static void cross(struct course *c, const struct imp_decision *d,
                  const struct imp_vertex *v)
{
    double ratio = 1;
    if (!v || !v->on) {
        c->beta *= (double)d->passes;
        return;
    }
    const imp_spec p = imp__track_density(c->m->scene, v->on, c->carried, c->m->least);
    if (c->m->flights) collisions_look(c->m->scene, v, c->sum);
    if (c->m->flights || c->carried) ratio = lanes_ratio(c, p, 1 / (double)d->passes);
    c->w *= ratio;
    c->beta *= p * ((double)d->passes / imp_max(ratio, TINY)); /* as in tracking.c */
}

/* Roulette at a step that it plays with; f: the value there. */
static void roll(struct course *c, const struct looked *v, const struct imp_decision *d,
                 imp_spec step, double ratio, const struct imp_bsdf *next)
{
    struct imp_moments *sum = c->sum;
    const bool four = c->carried != NULL;
    const double q = c->m->guided
                         ? (double)d->survive
                         : survival_now(c->m, v, step * (1 / imp_max(ratio, TINY)),
                                        c->beta, c->eta, four);
    const bool first = !c->settled;
    c->w *= q / (double)d->survive;
    c->beta *= 1 / q;
    c->settled = true;
    if (first || !c->own) return;
    const int a = imp__store_class(v->bsdf);
    sum->steps[a] += c->stratum_weight;
    for (int k = 0; next && k < 4; k++)
        sum->growth[a][imp__store_class(next)][k] +=
            c->stratum_weight * step[k] * step[k] / (double)d->survive;
}

/* The continuation of a vertex. */
static void step_on(struct course *c, const struct imp_decision *d,
                    const struct imp_vertex *at, const struct imp_bsdf *next)
{
    const struct imp_densities *m = c->m;
    struct looked v; /* its inputs are not cleared: most materials have few */
    v.bsdf = imp__decided_bsdf(m->scene, d);
    v.carried = c->carried;
    const bool moved = v.bsdf && v.bsdf->index >= 0 && m->moved[v.bsdf->index];
    const bool lanes = v.bsdf && v.bsdf->shaped && !d->alone;
    if (v.bsdf && (moved || lanes || c->rolls)) {
        look(m, d, &v);
        const double ratio = moved || lanes ? direction_ratio(c, &v, d) : 1;
        c->any |= moved && d->share > 0;
        c->seen *= ratio;
        c->w *= ratio;
        if (c->rolls) {
            imp_spec f;
            imp__bsdf_eval(v.bsdf, c->carried, v.in, &v.dirs, &f);
            const imp_spec step = f * (1 / (double)d->pdf);
            c->beta *= seen_by_roulette(step * (1 / imp_max(ratio, TINY)),
                                        c->carried != NULL, c->zeros);
            if (v.bsdf->ops->index_ratio && !v.bsdf->shaped)
                c->eta *= v.bsdf->ops->index_ratio(v.bsdf, v.in, &v.dirs);
            if (d->survive < 1) roll(c, &v, d, step, ratio, next);
        }
    }
    cross(c, d, at);
}

/* Density now over density then of vertices [j, end) of the record, or of those from `at`
 * on, which are evaluated, with all that hangs on them. */
static double course_weight(struct course *c, uint64_t j, uint64_t end,
                            const struct imp_vertex *at)
{
    for (; at || j < end; at = at ? at->next : NULL, j++) {
        struct imp_decision kept;
        struct imp_packed_head head;
        if (!at) imp__packed_step(imp__record_words(c->record, j), &head, &kept);
        const struct imp_decision *d = at ? &at->d : &kept;
        const struct imp_bsdf *next = NULL;
        double branches = 1;
        for (const struct imp_side *s = at ? at->side : NULL; s; s = s->next) {
            struct course side = *c;
            side.own = false;
            side.w = 1;
            branches *= course_weight(&side, end, end, s->walk.first);
        }
        c->w *= branches;
        if (!d->goes_on) continue;
        if (at && at->next) next = imp__decided_bsdf(c->m->scene, &at->next->d);
        else if (!at && j + 1 < end)
            next = imp__packed_bsdf(c->m->scene, imp__record_words(c->record, j + 1));
        step_on(c, d, at, next);
    }
    return c->w;
}

/* Walks of the subset are far from each other in memory: the head of the next but one, which
 * points to its vertices, and the vertices of the next one are prefetched. */
static void fetch(const struct imp_record *r, size_t next, size_t after)
{
    if (after < r->n_walks) {
        const char *head = (const char *)imp__record_at(r, after);
        __builtin_prefetch(head);
        __builtin_prefetch(head + sizeof(struct imp_record_walk) - 1);
    }
    if (next >= r->n_walks) return;
    const struct imp_record_walk *k = imp__record_at(r, next);
    for (uint32_t j = 0; j < k->n; j++) {
        const char *d = (const char *)imp__record_words(r, k->first + j);
        for (size_t b = 0; b < IMP_RECORD_FETCH; b += IMP_CACHE_LINE)
            __builtin_prefetch(d + b);
    }
}

enum imp_status imp__store_moments(const struct imp_store *s,
                                   const struct imp_densities *d,
                                   const struct imp_tracer *tracer,
                                   struct imp_arena *arena, size_t tile,
                                   const float *mask, const struct imp_asking *asking,
                                   struct imp_moments *sum)
{
    const struct imp_record *r = &s->records[tile];
    const int x0 = (int)(tile % (size_t)s->across) * IMP_STORE_SIDE - s->margin;
    const int y0 = (int)(tile / (size_t)s->across) * IMP_STORE_SIDE - s->margin;
    const int side = imp_min(IMP_STORE_SIDE, s->width + s->margin - x0);
    const bool rolls =
        s->roulette && d->weights && d->integrator->ends_by != IMP_ENDS_BY_ABSORPTION;
    const bool tracks = (rolls && !d->guided) || d->flights || tracer->wavelengths;
    double of, of_next, of_after;
    size_t next = imp__store_next(s, asking, tile, 0, &of_next);
    size_t after = imp__store_next(s, asking, tile, next + 1, &of_after);
    while (next < r->n_walks) {
        const size_t i = next;
        of = of_next;
        next = after;
        of_next = of_after;
        after = imp__store_next(s, asking, tile, next + 1, &of_after);
        const struct imp_record_walk *k = imp__record_at(r, i);
        const int pixel = (int)(i / s->n);
        const int x = imp_clamp(x0 + pixel % side, 0, s->width - 1);
        const int y = imp_clamp(y0 + pixel / side, 0, s->height - 1);
        struct imp_walk walk = {.key = k->key};
        if (next > i + 1) fetch(r, next, after);
        if (mask && !(mask[(size_t)y * (size_t)s->width + (size_t)x] > 0)) continue;
        const struct imp_arena_mark mark = imp__arena_mark(arena);
        if (k->n_items > 0 && (tracks || k->n_vertices > k->n))
            imp__record_walk(r, i, tracer, arena, &walk);
        else if (tracer->wavelengths && !imp__walk_wave(tracer, arena, k->wave, &walk))
            return imp__error(s->ctx, IMP_E_NOMEM, "no memory for a walk");
        if (walk.dropped == IMP_DROP_MEMORY)
            return imp__error(s->ctx, IMP_E_NOMEM, "no memory for a walk");
        struct course c = {.m = d,
                           .record = r,
                           .carried = walk.waves ? &walk.waves->carried : NULL,
                           .sum = sum,
                           .rolls = rolls,
                           .own = true,
                           .p = imp__spec(1),
                           .beta = imp__spec(1),
                           .w = 1,
                           .eta = 1,
                           .stratum_weight = of,
                           .seen = 1};
        c.lanes = c.carried ? c.carried->n : tracer->scene->channels;
        const double w = course_weight(&c, k->first, k->first + k->n, walk.first);
        if (c.any) {
            sum->moved += of;
            sum->seen += of * c.seen;
        }
        sum->n += of;
        sum->w += of * w;
        sum->w2 += of * w * w;
        imp__arena_rewind(arena, mark);
    }
    return IMP_OK;
}

double imp__moments_radius(const struct imp_moments *sum)
{
    double most = 0;
    int from[IMP_STORE_CLASSES], n = 0; /* classes that go on; others have rows of 0 */
    for (int a = 0; a < IMP_STORE_CLASSES; a++)
        if (sum->steps[a] > 0) from[n++] = a;
    for (int c = 0; c < 4; c++) {
        double T[IMP_STORE_CLASSES][IMP_STORE_CLASSES], x[IMP_STORE_CLASSES], radius = 0;
        for (int a = 0; a < n; a++) {
            x[a] = 1;
            for (int b = 0; b < n; b++)
                T[a][b] = sum->growth[from[a]][from[b]][c] / sum->steps[from[a]];
        }
        for (int round = 0; round < 100; round++) { /* power iteration */
            double y[IMP_STORE_CLASSES], largest = 0;
            for (int a = 0; a < n; a++) {
                y[a] = 0;
                for (int b = 0; b < n; b++) y[a] += T[a][b] * x[b];
                largest = imp_max(y[a], largest);
            }
            radius = largest;
            if (!(largest > 0)) break;
            /* Shifted, so that classes that take turns do not oscillate. */
            double norm = 0;
            for (int a = 0; a < n; a++) {
                x[a] = y[a] + 0.1 * largest * x[a];
                norm = imp_max(x[a], norm);
            }
            for (int a = 0; a < n; a++) x[a] /= norm;
        }
        most = imp_max(radius, most);
    }
    return most;
}
