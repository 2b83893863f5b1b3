/* SPDX-License-Identifier: Apache-2.0
 *
 * Collisions in lanes: a phase function times an albedo, as the kernel of a vertex whose frame has the
 * axes of the world (scene/in_medium.h, of points alone). And what rays that leave vertices in lanes
 * have in media. */
#include "in_media.h"
#include "lanes_record.h"
#include "scene/sealed.h"
#include "walk/media/tracking.h"

static const struct imp_phase *phase_of(const struct imp_bsdf *b)
{
    const struct imp_medium *m = b->self;
    return m->phase;
}

static imp_wide_truth sample(const struct imp_bsdf *b, uint64_t derivative,
                             const struct imp_wide_color *in, const imp_wide3 *wo,
                             const imp_wide u[3], imp_wide3 *wi, imp_wide_lobe *lobe)
{
    (void)derivative, (void)in, (void)lobe;
    *wi = imp__phase_lanes(phase_of(b))->sample(phase_of(b), wo, u);
    return ~(imp_wide_truth){0};
}

/* in[0]: the albedo */
static imp_wide pdf_eval(const struct imp_bsdf *b, uint64_t derivative,
                         const struct imp_wide_color *in, const imp_wide3 *wo,
                         const imp_wide3 *wi, const imp_wide_lobe *lobe, int colors,
                         struct imp_wide_color *f)
{
    (void)derivative, (void)lobe;
    const imp_wide p = imp__phase_lanes(phase_of(b))->value(phase_of(b), wo, wi);
    for (int c = 0; c < colors; c++) f->c[c] = p * in[0].c[c];
    return p;
}

bool imp__collision_bin(const struct imp_tracer *tracer, int medium, struct imp_bin *bin)
{
    static const struct imp_bsdf_lanes kernel = {.sample = sample, .pdf_eval = pdf_eval};
    const struct imp_medium *m = tracer->scene->media[medium];
    const bool tree = tracer->integrator->light_tree && tracer->scene->light_tree;
    imp_spec in[IMP_INPUTS_MAX], albedo;
    struct imp_coefficients c;
    if (tree || !imp__phase_lanes(m->phase)) return false;
    for (int j = 0; j < m->n_in; j++) in[j] = m->input[j]->value;
    m->ops->eval(m, in, &c);
    for (int k = 0; k < 4; k++)
        albedo[k] = c.extinction[k] > 0 ? c.scattering[k] / c.extinction[k] : 0;
    *bin = (struct imp_bin){.medium = medium,
                            .sealed = imp__is_sealed(tracer->scene, m),
                            .bsdf = m->scatterer,
                            .kernel = &kernel,
                            .plain = true};
    bin->in[0] = imp__wide_color(albedo);
    return true;
}

/* ---- Where they are, and what leaves vertices ---------------------------------------------- */

void imp__collision_places(const struct imp_depth *d, const int32_t *order,
                           struct imp_wide_surface *out)
{
    const struct imp_wide_surface none = {
        .frame = {.s.x = imp__wide(1), .t.y = imp__wide(1), .n.z = imp__wide(1)}};
    *out = none;
    out->p = (imp_wide3){imp__wide_taken(d->hits->t, order),
                         imp__wide_taken(d->hits->u, order),
                         imp__wide_taken(d->hits->v, order)};
}

/* The medium on the side of vertex k that dir points to. */
static int medium_beyond(const struct imp_depth *d, const struct imp_bin *bin,
                         const struct imp_lanes_vertices *v, imp_v3 dir, int k)
{
    const int ray = v->order[k], here = d->media->here[ray];
    if (bin->medium >= 0) return here;
    return imp__media_beyond(d->bundle->tracer->scene->shapes[d->hits->shape[ray]],
                             imp__wide3_lane(&v->x.ng, k), dir, here);
}
/* How far rays from vertex k begin behind it. */
static double begins_behind(const struct imp_bin *bin, const struct imp_lanes_vertices *v,
                            int k)
{
    return bin->medium >= 0 ? imp__begins_behind(imp__wide3_lane(&v->x.p, k)) : 0;
}

void imp__shadow_in_media(struct imp_depth *d, const struct imp_bin *bin,
                          const struct imp_lanes_vertices *v, int k, int i)
{
    struct imp_shadows *to = d->shadows;
    const imp_v3 dir = imp__column_v3(to->ray.d, i);
    to->walk[i] = v->walk[k];
    to->medium[i] = medium_beyond(d, bin, v, dir * (1 / imp__length(dir)), k);
    to->behind[i] = begins_behind(bin, v, k);
}

void imp__ray_in_media(struct imp_depth *d, const struct imp_bin *bin,
                       const struct imp_lanes_vertices *v, int k, int i)
{
    struct imp_flights *to = d->next;
    const int from = v->order[k];
    const imp_v3 dir = imp__column_v3(to->ray.d, i);
    to->medium[i] = medium_beyond(d, bin, v, dir, k);
    to->behind[i] = begins_behind(bin, v, k);
    imp__column_put(to->ray.o, i, imp__column_v3(to->ray.o, i) - dir * to->behind[i]);
    for (int c = 0; c < 3; c++) to->ratio[c][i] = d->rays->ratio[c][from];
    to->share[i] = d->rays->share[from];
}
