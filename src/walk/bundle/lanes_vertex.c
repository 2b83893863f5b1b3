/* SPDX-License-Identifier: Apache-2.0
 *
 * Vertices of a bundle in lanes: those on one shape, IMP_WIDE_LANES at a time. What the one step does
 * for a walk alone (path/sensor_end.h, core/scatter.c, core/light.c) stands here for walks that
 * have a kernel, light samples and roulette, and nothing more. */
#include "kind/kind_lanes.h"
#include "lanes_light.h"
#include "math/offset.h"

/* ---- What is in lanes -------------------------------------------------------------------- */

bool imp__lanes_fit(const struct imp_tracer *t)
{
    const struct imp_walk_integrator *w = t->integrator;
    return !t->scene->timed_lights && w->ends_by == IMP_ENDS_BY_ROULETTE &&
           w->directions && !w->only_points && t->scene->n_groups == 0;
}

bool imp__shape_in_lanes(const struct imp_scene *scene, int shape)
{
    const struct imp_shape *s = scene->shapes[shape];
    const struct imp_bsdf *b = imp__shape_bsdf(scene, s);
    return s->emitter < 0 && !s->body && !b->shaped && b->flags == IMP_BSDF_SMOOTH &&
           b->n_in <= IMP_INPUTS_MAX && imp__bsdf_lanes(b);
}

void imp__shape_bin(const struct imp_tracer *tracer, int shape, struct imp_bin *bin)
{
    const struct imp_shape *s = tracer->scene->shapes[shape];
    const struct imp_bsdf *b = imp__shape_bsdf(tracer->scene, s);
    bin->shape = s;
    bin->bsdf = b;
    bin->surface = imp__shape_lanes(s);
    bin->kernel = imp__bsdf_lanes(b);
    bin->plain = true;
    for (int j = 0; j < b->n_in; j++) bin->plain &= b->input[j]->plain;
    for (int j = 0; bin->plain && j < b->n_in; j++)
        bin->in[j] = imp__wide_color(b->input[j]->value);
}

/* ---- Where it is ------------------------------------------------------------------------- */

static const struct imp_shape *shape_of(const struct imp_depth *d, int ray)
{
    return d->bundle->tracer->scene->shapes[d->hits->shape[ray]];
}

/* By the shapes' own functions. */
static void surface_alone(const struct imp_depth *d, const struct imp_wide_hits *h,
                          struct imp_wide_surface *out)
{
    for (int k = 0; k < IMP_WIDE_LANES; k++) {
        const int i = h->at[k];
        const struct imp_shape *s = shape_of(d, i);
        const struct imp_hit hit = {.shape = s->index,
                                    .prim = h->prim[i],
                                    .t = h->t[i],
                                    .u = h->u[i],
                                    .v = h->v[i]};
        const imp_v3 o = imp__column_v3(h->o, i), d = imp__column_v3(h->d, i);
        struct imp_surface x;
        s->ops->surface(s, &hit, &o, &d, &x);
        imp__wide3_set(&out->p, k, x.p);
        imp__wide3_set(&out->ng, k, x.ng);
        imp__wide3_set(&out->frame.s, k, x.s);
        imp__wide3_set(&out->frame.t, k, x.t);
        imp__wide3_set(&out->frame.n, k, x.n);
        out->uv[0][k] = x.uv[0];
        out->uv[1][k] = x.uv[1];
    }
}

/* Inputs that are textures, point by point. */
static void inputs_alone(const struct imp_depth *d, const struct imp_bsdf *b,
                         const struct imp_carried *const *carried,
                         const struct imp_wide_hits *h, const struct imp_wide_surface *x,
                         struct imp_wide_color *in)
{
    for (int k = 0; k < IMP_WIDE_LANES; k++) {
        imp_spec own[IMP_INPUTS_MAX];
        const struct imp_texcoord at = {
            .uv = {imp__decide1(x->uv[0][k]), imp__decide1(x->uv[1][k])},
            .p = imp__decide(imp__wide3_lane(&x->p, k)),
            .carried = carried ? carried[k] : NULL,
            .shape = shape_of(d, h->at[k]),
            .prim = h->prim[h->at[k]]};
        imp__inputs_eval(b->input, b->n_in, &at, own);
        for (int j = 0; j < b->n_in; j++)
            for (int c = 0; c < 4; c++) in[j].c[c][k] = own[j][c];
    }
}

/* imp__offset. */
static imp_wide3 offset(imp_wide3 p, imp_wide3 ng, imp_wide3 d)
{
    const imp_wide scale = imp__wide_larger(
        imp__wide_magnitude(p.x),
        imp__wide_larger(imp__wide_magnitude(p.y), imp__wide_magnitude(p.z)));
    return imp__wide3_plus(
        p, imp__wide3_times(ng, imp__wide_signed_as((1 + scale) * IMP_RAY_EPSILON,
                                                    imp__wide3_inner(ng, d))));
}

static inline imp_wide_truth is_zero(const imp_wide f[4], int colors)
{
    const imp_wide zero = imp__wide(0);
    imp_wide_truth all = (f[0] == zero) & (f[1] == zero) & (f[2] == zero);
    if (colors > 3) all &= f[3] == zero;
    return all;
}

/* ---- What leaves it ---------------------------------------------------------------------- */

/* The vertices at work. */
struct vertices {
    struct imp_wide_surface x;
    imp_wide3 wo, wo_drawn;
    struct imp_wide_block numbers; /* of the walks' points, or of their keys */
    bool points;
    int depth;
    const struct imp_wide_color *in;
    unsigned on; /* a bit for each lane that counts */
    int at;      /* place of the first among the values of the depth */
    const int32_t *order;
    imp_wide3 faced; /* normals, where there is a tree of lights */
    const struct imp_carried *carried[IMP_WIDE_LANES]; /* where walks carry wavelengths */
};

/* imp__light_place of lane k: kernels in lanes send nothing through the surface. */
static inline struct imp_light_place place_of(const struct vertices *v, int k)
{
    return (struct imp_light_place){.p = imp__wide3_lane(&v->x.p, k),
                                    .n = imp__wide3_lane(&v->faced, k),
                                    .faces = true};
}

static inline imp_wide number(const struct vertices *v, int use)
{
    return imp__wide_number(&v->numbers, v->points ? (uint32_t)imp__slot(use)
                                                   : imp__dim(v->depth, use));
}

/* The power heuristic with exponent 2, over the density a. */
static imp_wide power_heuristic_over(imp_wide a, imp_wide b)
{
    const imp_wide a2 = a * a, b2 = b * b;
    return imp__wide_choose(a2 > imp__wide(0), a / (a2 + b2), imp__wide(0));
}

/* B of the vertices as if all lights were seen, and the shadow rays. */
static inline __attribute__((always_inline)) void
light(struct imp_depth *d, const struct imp_bin *bin, const struct vertices *v,
      const int colors, struct imp_wide_color *brings)
{
    const imp_wide zero = imp__wide(0);
    struct imp_lanes_light l;
    struct imp_wide_color f;
    const imp_wide u[2] = {number(v, IMP_DIM_LIGHT_U), number(v, IMP_DIM_LIGHT_V)};
    *brings = imp__wide_color(imp__spec(0));
    if (d->bundle->tracer->scene->n_emitters == 0) return;
    const struct imp_scene *scene = d->bundle->tracer->scene;
    const imp_wide which =
        v->points || scene->n_emitters == 1 ? u[0] : number(v, IMP_DIM_LIGHT);
    const struct imp_carried *const *carried = colors > 3 ? v->carried : NULL;
    if (imp_unlikely(d->next->left != NULL))
        imp__lanes_tree_draw(scene, carried, &v->x.p, &v->faced, u, which, v->points,
                             v->on, &l);
    else imp__lanes_light_draw(scene, carried, &v->x.p, u, which, v->points, v->on, &l);
    const imp_wide3 wi = imp__wide3_decide(imp__into_wide_frame(&v->x.frame, l.at.wi));
    const imp_wide pdf = bin->kernel->pdf_eval(bin->bsdf, v->in, &v->wo, &wi, colors, &f);
    const imp_wide p = l.at.pdf * l.pmf;
    const imp_wide weight =
        imp__wide_decide(imp__wide_choose(l.delta, 1 / p, power_heuristic_over(p, pdf)));
    for (int c = 0; c < colors; c++) f.c[c] *= l.radiance.c[c];
    const imp_wide_truth wanted = l.at.drawn & (pdf > zero) & ~is_zero(f.c, colors);
    const unsigned bits = imp__wide_bits(wanted) & v->on;
    for (int c = 0; c < colors; c++)
        brings->c[c] = imp__wide_choose(wanted, f.c[c] * weight, zero);
    if (!bits) return;

    struct imp_shadows *to = d->shadows;
    const int n = to->ray.n;
    const imp_wide3 o = offset(v->x.p, v->x.ng, l.at.wi);
    imp__wide3_append(to->ray.o, n, bits, o);
    imp__wide3_append(to->ray.d, n, bits,
                      imp__wide3_choose(l.far, l.at.wi, imp__wide3_minus(l.at.p, o)));
    imp__wide_append(&to->ray.far[n], bits,
                     imp__wide_choose(l.far, imp__wide(INFINITY),
                                      imp__wide(1 - 10 * IMP_RAY_EPSILON)));
    for (unsigned left = bits; left; left &= left - 1) {
        const int k = __builtin_ctz(left), i = to->ray.n++;
        to->at[i] = v->at + k;
        if (to->ray.time) to->ray.time[i] = d->rays->ray.time[v->order[k]];
    }
}

/* Survival as decided, and who survives. */
static inline imp_wide_truth survives(const struct imp_depth *d, const struct vertices *v,
                                      const imp_wide beta[4], int colors, imp_wide eta,
                                      imp_wide *survive)
{
    const struct imp_tracer *t = d->bundle->tracer;
    *survive = imp__wide(1);
    if (d->depth + 1 < t->integrator->rr_depth) return ~(imp_wide_truth){0};
    imp_wide most = imp__wide_larger(beta[0], imp__wide_larger(beta[1], beta[2]));
    if (colors > 3) most = imp__wide_larger(most, beta[3]);
    const imp_wide q = imp__wide_lesser(most * eta * eta, imp__wide(0.95));
    *survive = imp__wide_decide(imp__wide_larger(q, imp__wide(t->survival)));
    return number(v, IMP_DIM_SURVIVE) < *survive;
}

/* The weights of the vertices' steps, and the next rays. */
static inline __attribute__((always_inline)) void
scatter(struct imp_depth *d, const struct imp_bin *bin, const struct vertices *v,
        const int colors, struct imp_wide_color *w)
{
    const imp_wide zero = imp__wide(0);
    const imp_wide u[3] = {number(v, IMP_DIM_LOBE), number(v, IMP_DIM_DIR_U),
                           number(v, IMP_DIM_DIR_V)};
    imp_wide3 wi;
    struct imp_wide_color f;
    imp_wide_truth goes = bin->kernel->sample(bin->bsdf, v->in, &v->wo_drawn, u, &wi);
    const imp_wide3 world = imp__out_of_wide_frame(&v->x.frame, wi);
    wi = imp__wide3_decide(wi);
    const imp_wide pdf = imp__wide_decide(
        bin->kernel->pdf_eval(bin->bsdf, v->in, &v->wo, &wi, colors, &f));
    const imp_wide by = 1 / pdf, eta = imp__wide_taken(d->rays->eta, v->order);
    imp_wide beta[4], survive;
    goes &= pdf > zero;
    for (int c = 0; c < colors; c++)
        beta[c] = imp__wide_taken(d->rays->beta[c], v->order) * (f.c[c] * by);
    goes &= ~is_zero(beta, colors);
    goes &= survives(d, v, beta, colors, eta, &survive);
    const imp_wide again = 1 / survive, scale = 1 / (pdf * survive);
    for (int c = 0; c < colors; c++)
        w->c[c] = imp__wide_choose(goes, f.c[c] * scale, zero);

    struct imp_flights *to = d->next;
    const unsigned bits = imp__wide_bits(goes) & v->on;
    const int n = to->ray.n;
    imp__wide3_append(to->ray.o, n, bits, offset(v->x.p, v->x.ng, world));
    imp__wide3_append(to->ray.d, n, bits, world);
    imp__wide_append(&to->ray.far[n], bits, imp__wide(INFINITY));
    imp__wide3_append(to->from, n, bits, v->x.p);
    imp__wide_append(&to->pdf[n], bits, pdf);
    for (int c = 0; c < colors; c++)
        imp__wide_append(&to->beta[c][n], bits, beta[c] * again);
    imp__wide_append(&to->eta[n], bits, eta);
    for (unsigned left = bits; left; left &= left - 1) {
        const int k = __builtin_ctz(left), i = to->ray.n++, from = v->order[k];
        to->walk[i] = d->rays->walk[from];
        to->up[i] = v->at + k;
        if (to->left) to->left[i] = place_of(v, k);
        if (to->ray.time) to->ray.time[i] = d->rays->ray.time[from];
    }
}

/* ---- All --------------------------------------------------------------------------------- */

static inline void color_store(double *const to[4], int colors, int at,
                               const struct imp_wide_color *x)
{
    for (int c = 0; c < colors; c++) imp__wide_store(&to[c][at], x->c[c]);
}

static inline __attribute__((always_inline)) void work(struct imp_depth *d,
                                                       const struct imp_bin *bin,
                                                       const int32_t *order, int n,
                                                       int at, const int colors)
{
    const struct imp_bundle *b = d->bundle;
    const struct imp_wide_hits hits = {.o = d->rays->ray.o,
                                       .d = d->rays->ray.d,
                                       .t = d->hits->t,
                                       .u = d->hits->u,
                                       .v = d->hits->v,
                                       .prim = d->hits->prim,
                                       .at = order};
    struct imp_wide_color in[IMP_INPUTS_MAX], brings, weight;
    struct vertices v; /* field by field: clearing all of it takes time */
    v.on = imp__bits_first(n);
    v.at = at;
    v.order = order;
    v.points = b->tracer->points != NULL;
    v.depth = d->depth;
    int32_t walk[IMP_WIDE_LANES];
    for (int k = 0; k < IMP_WIDE_LANES; k++) walk[k] = d->rays->walk[order[k]];
    if (colors > 3)
        for (int k = 0; k < IMP_WIDE_LANES; k++)
            v.carried[k] = &b->waves[walk[k]]->carried;
    v.numbers =
        imp__wide_block(b->tracer->points, b->set, b->index, walk, imp__block(d->depth));
    if (bin->surface) bin->surface->surface(bin->shape, &hits, !bin->plain, &v.x);
    else surface_alone(d, &hits, &v.x);
    v.wo_drawn = imp__into_wide_frame(
        &v.x.frame, imp__wide3_opposite(imp__wide3_taken(d->rays->ray.d, order)));
    v.wo = imp__wide3_decide(v.wo_drawn);
    v.in = bin->in;
    if (imp_unlikely(d->next->left != NULL))
        v.faced = imp__wide3_choose(v.wo.z < imp__wide(0),
                                    imp__wide3_opposite(v.x.frame.n), v.x.frame.n);
    if (colors > 3 || !bin->plain) {
        inputs_alone(d, bin->bsdf, colors > 3 ? v.carried : NULL, &hits, &v.x, in);
        v.in = in;
    }
    if (b->tracer->integrator->lights) light(d, bin, &v, colors, &brings);
    else brings = imp__wide_color(imp__spec(0));
    scatter(d, bin, &v, colors, &weight);

    const struct imp_wide_color none = imp__wide_color(imp__spec(0));
    color_store(d->values->e, colors, at, &none);
    color_store(d->values->b, colors, at, &brings);
    color_store(d->values->w, colors, at, &weight);
    color_store(d->values->beyond, colors, at, &none);
    for (int k = 0; k < n; k++) {
        d->values->up[at + k] = d->rays->up[order[k]];
        b->valid[walk[k]] = true;
    }
}

void imp__vertices_in_lanes(struct imp_depth *d, const struct imp_bin *bin,
                            const int32_t *order, int n, int at)
{
    int32_t rest[IMP_WIDE_LANES];
    for (int i = 0; i < n; i += IMP_WIDE_LANES) {
        const int left = imp_min(n - i, IMP_WIDE_LANES);
        const int32_t *here = order + i;
        if (left < IMP_WIDE_LANES) { /* the lanes that are left repeat one */
            for (int k = 0; k < IMP_WIDE_LANES; k++) rest[k] = here[k < left ? k : 0];
            here = rest;
        }
        if (imp_likely(d->bundle->colors == 3)) work(d, bin, here, left, at + i, 3);
        else work(d, bin, here, left, at + i, 4);
    }
}
