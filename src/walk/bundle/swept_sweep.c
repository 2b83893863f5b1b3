/* SPDX-License-Identifier: Apache-2.0
 *
 * Sweeps of walks of a bundle that kept columns (swept.h): those of path/sweep.c, to the bit. */
#include "swept.h"
#include "walk/path/sweep.h"

static inline imp_spec lane_of(const imp_wide *columns, int colors, int k)
{
    return (imp_spec){columns[0][k], columns[1][k], columns[2][k],
                      colors > 3 ? columns[3][k] : 0};
}

/* The light sample of lane k, as imp__emitter_pieces. */
static void light_piece(const struct imp_sweep *s, const struct imp_swept_light *l, int k,
                        int colors, const struct imp_carried *carried, imp_spec P)
{
    const int emitter = l->emitter[k];
    const struct imp_emitter *e = s->tracer->scene->emitters[emitter];
    if (!s->tracer->active->emitter[emitter]) return;
    if (imp_likely(
            imp__emitter_even(e, carried))) { /* of derivative 1, where it is seen */
        imp__sweep_plain(s, e->input[0],
                         P * lane_of(l->f.c, colors, k) * imp__spec(l->weight[k]));
        return;
    }
    struct imp_emitter_piece piece = {
        emitter,
        {{l->uv[0][k], l->uv[1][k]},
         l->dist[k],
         l->cos_light[k],
         imp__wide3_lane(&l->d, k)},
        {.uv = {l->uv[0][k], l->uv[1][k]},
         .p = imp__wide3_lane(&l->p, k),
         .carried = carried,
         .shape = e->shape,
         .prim = l->prim[k]},
        {lane_of(l->f.c, colors, k), imp__spec(l->weight[k])},
        P};
    imp__sweep_emitter(s, &piece);
}

/* The sky that it meets. */
static void sky_piece(const struct imp_sweep *s, const struct imp_swept_light *l, int k,
                      const struct imp_carried *carried, imp_spec P)
{
    const struct imp_emitter *e = s->tracer->scene->emitters[l->emitter[0]];
    const imp_spec one = imp__spec(1);
    if (imp_likely(imp__emitter_even(e, carried))) {
        imp__sweep_plain(s, e->input[0], P * l->weight[k]);
        return;
    }
    struct imp_emitter_piece piece = {l->emitter[0],
                                      {{0, 0}, INFINITY, 1, imp__wide3_lane(&l->d, k)},
                                      {.p = imp__wide3_lane(&l->p, k), .prim = -1},
                                      {one, one},
                                      P * l->weight[k]};
    imp__sweep_emitter(s, &piece);
}

static void add_computed(const struct imp_swept_lanes *of, int k,
                         const struct imp_carried *carried, const imp_wide3 *wi, int lobe,
                         imp_spec by, imp_spec adjoint, imp_spec *bar)
{
    const struct imp_swept_dirs *x = of->dirs;
    const struct imp_bsdf *b = of->bsdf;
    const struct imp_dirs d = {imp__wide3_lane(&x->wo, k), imp__wide3_lane(wi, k), lobe,
                               0};
    imp_spec df[IMP_INPUTS_MAX];
    imp__bsdf_eval_d(b, carried, x->in + k * b->n_in, &d, df);
    for (int j = 0; j < b->n_in; j++) {
        df[j] *= by;
        bar[j] += df[j] * adjoint;
    }
}

/* What arrives at lane k of vertices: where light is seen, that by the sample, and by the step. */
struct arriving {
    bool lit, on;
    imp_spec light, step;
};

/* Kept derivatives of lane k, those by the input in column `at`. */
static inline imp_spec bar_kept(const struct imp_swept_lanes *of, int at, int colors,
                                int k, const struct arriving *a)
{
    imp_spec bar = {0};
    if (a->lit) bar += lane_of(of->by_light + at, colors, k) * a->light;
    if (a->on) bar += lane_of(of->by_step + at, colors, k) * a->step;
    return bar;
}

static inline void texels_sweep(const struct imp_sweep *s,
                                const struct imp_wide_texels *t, int k, imp_spec bar)
{
    const imp_spec other = bar * s->ratio;
    if (t->param[k] < 0) return;
    for (int j = 0; j < t->n; j++) {
        const double weight = t->weight[j][k];
        const imp_spec part = bar * weight, part_other = other * weight;
        imp__sweep_add(s, t->param[k], (size_t)t->element[j][k], t->channels[k], &part,
                       &part_other);
    }
}

/* By constants in colours, and by texels that are known. */
static inline void numbers_sweep(const struct imp_sweep *s,
                                 const struct imp_swept_lanes *of, int k, int colors,
                                 const struct arriving *a)
{
    const struct imp_wide_texels *texels = of->texels;
    int at = 0;
    for (uint64_t left = of->inputs; left; left &= left - 1, at += colors) {
        const struct imp_input *input = of->bsdf->input[__builtin_ctzll(left)];
        const imp_spec bar = bar_kept(of, at, colors, k, a);
        if (input->plain) imp__sweep_plain(s, input, bar);
        else texels_sweep(s, texels++, k, bar);
    }
}

static void inputs_sweep(const struct imp_sweep *s, const struct imp_swept_lanes *of,
                         int k, int colors, const struct imp_carried *carried,
                         const struct arriving *a)
{
    const struct imp_bsdf *b = of->bsdf;
    const struct imp_swept_dirs *x = of->dirs;
    const struct imp_swept_place *p = of->place;
    struct imp_texcoord at = {.carried = carried, .prim = -1};
    imp_spec bar[IMP_INPUTS_MAX];
    int column = 0;
    for (int j = 0; j < b->n_in; j++) bar[j] = (imp_spec){0};
    for (uint64_t left = x ? 0 : of->inputs; left; left &= left - 1, column += colors)
        bar[__builtin_ctzll(left)] = bar_kept(of, column, colors, k, a);
    if (x && a->lit)
        add_computed(of, k, carried, &x->light, IMP_SMOOTH, lane_of(x->lit.c, colors, k),
                     a->light, bar);
    if (x && a->on)
        add_computed(of, k, carried, &x->wi, (int)x->lobe[k], imp__spec(x->scale[k]),
                     a->step, bar);
    if (p) {
        at.uv[0] = p->uv[0][k];
        at.uv[1] = p->uv[1][k];
        at.p = imp__wide3_lane(&p->p, k);
        at.shape = s->tracer->scene->shapes[p->shape[k]];
        at.prim = p->prim[k];
    }
    imp__sweep_inputs(s, b->input, b->n_in, &at, bar);
}

/* Pieces of lane k, as imp__scatterer_pieces. */
static inline void lane_sweep(const struct imp_sweep *s, const struct imp_swept_lanes *of,
                              int k, int colors, const struct imp_carried *carried,
                              imp_spec beyond, imp_spec P)
{
    struct arriving a = {.lit = of->lit >> k & 1, .light = P, .step = P * beyond};
    if (imp_unlikely(!of->bsdf)) {
        if (of->light) sky_piece(s, of->light, k, carried, P);
        return;
    }
    if (of->light && a.lit) light_piece(s, of->light, k, colors, carried, P);
    if (!of->inputs && !of->dirs) return;
    a.on = (of->on >> k & 1) && !imp__is_zero_used(a.step, carried);
    if (!a.lit && !a.on) return;
    if (of->numbers) numbers_sweep(s, of, k, colors, &a);
    else inputs_sweep(s, of, k, colors, carried, &a);
}

/* From the first vertex to the last. */
static void sweep(const struct imp_sweep *s, const struct imp_walk *walk, imp_spec P)
{
    const struct imp_swept_walk *own = (const struct imp_swept_walk *)walk->reduced;
    const struct imp_bundle *b = own->bundle;
    const struct imp_carried *carried = walk->waves ? &walk->waves->carried : NULL;
    int depth = 0;
    for (const struct imp_swept_depth *d = b->swept->first; d; d = d->next, depth++) {
        const int at = d->place[own->number];
        if (at < 0 || !d->of[at]) return;
        const int lane = d->lane[at];
        const imp_spec beyond = imp__column_color(d->values->beyond, b->colors, at);
        if (imp_unlikely(lane < 0)) {
            struct imp_vertex *v = d->of[at];
            if (lane == IMP_SWEPT_ALONE) v->beyond = beyond;
            if (!imp__sweep_vertices(s, walk, v, depth, &P)) return;
            continue;
        }
        lane_sweep(s, d->of[at], lane, b->colors, carried, beyond, P);
        P *= imp__column_color(d->values->w, b->colors, at);
        if (imp__is_zero_used(P, carried)) return;
    }
}

void imp__swept_sweep(const struct imp_tracer *tracer, const struct imp_walk *walk,
                      imp_spec adjoint, struct imp_sink *sink)
{
    const struct imp_sweep s = {tracer, sink, NULL, NULL, {0}};
    sweep(&s, walk, adjoint);
}

void imp__swept_both(const struct imp_tracer *tracer, const struct imp_walk *walk,
                     imp_spec adjoint, imp_spec ratio, const struct imp_sink_pair *to)
{
    const struct imp_sweep s = {tracer, to->first, to->second, to, ratio};
    sweep(&s, walk, adjoint);
}
