/* SPDX-License-Identifier: Apache-2.0
 *
 * Coefficients of a point from recorded walks: of every light sample and every escape into the sky
 * its direction and what it would bring of radiance 1 there; and, at every vertex but the
 * first, rays to the sun as it is at some hours of the year.
 *
 * Rays are as many as the throughput up to a vertex is large, since what each brings is, too: half
 * of the light, half of the rays. The hours of a vertex are drawn by patches, and in a patch by the
 * sun's illuminance: the sum over the hours of what the sun brings reflected is without bias, that
 * of an hour alone is a mean over the patch. Light that a mirror or a lens brings from the
 * sun meets no ray of these: it is that of walks which leave through the sun's patch, spread
 * over it. */
#include "annual.h"
#include "math/offset.h"
#include "math/rng.h"
#include "walk/core/vertex.h"
#include <string.h>

enum { SUNS = 3 }; /* rays to the sun at a vertex that all light of a walk passes */

struct walk_job {
    const struct imp__annual *a;
    struct imp__annual_worker *w;
    const struct imp_walk *walk;
    bool mono;
    enum imp_status st;
};

static void sky_add(struct walk_job *j, imp_v3 w, imp_spec light, bool bent)
{
    const struct imp__annual *a = j->a;
    const int patch = imp__sky_patch_of(&a->patches, w);
    if (patch < 0) return;
    const double x = imp__annual_light(j->mono, light);
    const int cell = a->hours.cell_of[patch];
    j->w->C_sum[patch] += x;
    if (bent && cell >= 0)
        j->w->I_sum[cell] += x / imp__sky_patch_size(&a->patches, patch);
}

/* P: throughput up to v; k: its number in the walk, which numbers its random numbers. */
static void suns_add(struct walk_job *j, const struct imp_vertex *v, imp_spec P, int k)
{
    const struct imp__annual *a = j->a;
    const struct imp__annual_hours *h = &a->hours;
    const struct imp_key key = imp__key_branch(j->walk->key, k, 0x5u);
    const double rays = SUNS * imp_min(imp__annual_light(j->mono, P), 1.0);
    const int n = (int)(rays + imp__u01(key, 2 * SUNS));
    struct imp_surface at;
    if (n == 0) return;
    /* The sun's disc is small beside the patch. Entries side by side are read at once. */
    size_t entry = (size_t)(imp__u01(key, 2 * SUNS + 1) * (double)h->n_suns);
    __builtin_prefetch(&h->suns[entry]);
    if (!imp__decided_surface(a->scene, &v->d, j->walk->time, &at)) {
        j->st = imp__error(a->scene->ctx, IMP_E_UNSUPPORTED,
                           "shape %d (%s) does not say where its points are: the sun "
                           "over a year needs that",
                           v->d.shape, v->shape->ops->name);
        return;
    }
    const struct imp_frame frame = {at.s, at.t, at.n};
    const imp_v3 wo = imp__vertex_wo(v);
    const bool opaque = !(v->bsdf->flags & IMP_BSDF_TRANSMIT);
    for (int i = 0; i < n; i++, entry++) {
        if (entry >= h->n_suns) entry = 0;
        const struct imp__annual_sun *sun = &h->suns[entry];
        const int other = !((float)imp__u01(key, (uint32_t)i) < sun->part);
        const float *to = sun->to[other];
        const imp_v3 w = imp__v3((double)to[0], (double)to[1], (double)to[2]);
        const struct imp_dirs dirs = {wo, imp__to_local(&frame, w), IMP_SMOOTH, 0};
        if (opaque && !(dirs.wo[2] * dirs.wi[2] > 0)) continue;
        const int cell = sun->cell[other];
        imp_spec f;
        imp__bsdf_eval(v->bsdf, NULL, v->in, &dirs, &f);
        f *= P;
        if (imp__is_zero_used(f, false)) continue;
        f *= imp__annual_passes(a, j->walk->time, imp__offset(at.p, at.ng, w), w);
        j->w->I_sum[cell] += imp__annual_light(j->mono, f) * h->times[cell] / rays;
    }
}

static bool is_straight(const struct imp_vertex *v)
{
    return v->bsdf && v->d.lobe >= 0 && v->d.lobe < 64 &&
           v->bsdf->straight >> v->d.lobe & 1;
}

/* The vertices of a walk from number k on, the meter's being 0; of one that hangs on a vertex of
 * another the first has been looked at. bent: since the last vertex with a density, a lobe
 * turned the walk. */
static void walk_add(struct walk_job *j, const struct imp_walk *walk, imp_spec P, int k,
                     int straight, bool bent, bool hangs)
{
    const struct imp__annual *a = j->a;
    const int max_depth = a->tracer.integrator->max_depth;
    for (const struct imp_vertex *v = walk->first; v; v = v->next, hangs = false) {
        const struct imp_decision *d = &v->d;
        const bool starts = d->scatterer == IMP_AT_SENSOR;
        if (d->met.emitter == a->sky)
            sky_add(j, -imp__decided_v3(d->met.d), P * d->met.weight, bent);
        if (d->connection == IMP_CONNECTED && d->light.emitter == a->sky)
            sky_add(j, -imp__decided_v3(d->light.d), P * v->light_f * v->light_w, false);
        const bool rays = !hangs && k > 0 && v->bsdf && d->scatterer == IMP_AT_SURFACE &&
                          (v->bsdf->flags & IMP_BSDF_SMOOTH) && a->hours.n_cells > 0 &&
                          (max_depth < 0 || k - straight < max_depth);
        if (rays) suns_add(j, v, P, k);
        for (const struct imp_side *s = v->side; s; s = s->next)
            walk_add(j, &s->walk, P, k, straight, bent, true);
        if (!d->goes_on) continue;
        const bool passed = is_straight(v);
        if (!starts && d->lobe == IMP_SMOOTH) bent = false;
        else if (!starts && !passed) bent = true;
        if (passed && a->through) straight++;
        P *= v->w;
        if (!starts) k++;
    }
}

/* Group g takes sets of points of its own: groups are independent. */
static int64_t sample_of(const struct imp__annual *a, int g, int64_t i)
{
    const int64_t sets = (a->walks + IMP_SET_POINTS - 1) / IMP_SET_POINTS;
    return g * sets * IMP_SET_POINTS + i;
}

/* What comes from patches to group g. */
static bool parts_keep(struct imp__annual_worker *w, double each, int g,
                       struct imp__annual_at *at)
{
    struct imp__annual_part part[IMP__PATCHES];
    int n = 0;
    for (int p = 0; p < IMP__PATCHES; p++) {
        const float C = (float)(w->C_sum[p] * each);
        if (C != 0) part[n++] = (struct imp__annual_part){.C = C, .patch = p};
    }
    struct imp__annual_part *kept = imp__arena_take(&w->keep, (size_t)n, sizeof *kept);
    if (!kept) return false;
    memcpy(kept, part, (size_t)n * sizeof *kept);
    at->part[g] = kept;
    at->parts[g] = n;
    return true;
}

enum imp_status imp__annual_walks(const struct imp__annual *a, int x, int y, int g,
                                  struct imp__annual_worker *w, struct imp__annual_at *at)
{
    struct walk_job j = {.a = a, .w = w, .mono = a->scene->mode == IMP_MONO};
    struct imp_walk walk;
    const double each = 1 / (double)a->walks;
    memset(w->C_sum, 0, IMP__PATCHES * sizeof *w->C_sum);
    memset(w->I_sum, 0, IMP__PATCHES * sizeof *w->I_sum);
    for (int64_t i = 0; i < a->walks; i++) {
        const struct imp_arena_mark mark = imp__arena_mark(&w->arena);
        const int64_t sample = sample_of(a, g, i);
        imp__walk_trace(&a->tracer, &w->arena, x, y, sample, &walk);
        if (walk.dropped == IMP_DROP_MEMORY) return IMP_E_NOMEM;
        j.walk = &walk;
        if (walk.dropped != IMP_DROP_NONE) {
            const struct imp_drop_key key = {.seed = a->tracer.seed,
                                             .sample = sample,
                                             .cause = walk.dropped,
                                             .x = x + a->sensor->film.crop_x,
                                             .y = y + a->sensor->film.crop_y};
            imp__drops_add(&w->drops, &key);
        } else if (walk.valid) {
            walk_add(&j, &walk, imp__spec(1), 0, 0, false, false);
        }
        imp__arena_rewind(&w->arena, mark);
        if (j.st != IMP_OK) return j.st;
    }
    for (int c = 0; c < a->hours.n_cells; c++) at->I[c][g] = (float)(w->I_sum[c] * each);
    return parts_keep(w, each, g, at) ? IMP_OK : IMP_E_NOMEM;
}
