/* SPDX-License-Identifier: Apache-2.0
 *
 * Recorded walks are reduced: from the first vertex to the last, with M the product of all
 * factors so far that cannot change,
 *
 *     a term of the walk is  M c  times the inputs that may change.
 *
 * Terms between two factors that may change are at one level: constants are added up, and
 * so are the coefficients of one input. */
#include "reduce.h"
#include "kind/texture/bitmap.h"
#include "kind/texture/input.h"
#include <string.h>

#define PENDING 8 /* inputs of a level */

static bool is_zero(const struct imp_reduced *r, imp_spec c)
{
    for (int k = 0; k < r->of->channels; k++)
        if (c[k] != 0) return false;
    return true;
}

/* ---- A level --------------------------------------------------------------------- */

struct level {
    imp_spec constant;
    int n;
    struct {
        int slot;
        imp_spec c;
    } input[PENDING];
};

/* A walk while it is reduced. */
struct reducing {
    struct imp_reduced *r;
    const struct imp_scene *scene;
    imp_spec M;
    struct level level;
};

static void level_end(struct reducing *g)
{
    struct level *l = &g->level;
    if (!is_zero(g->r, l->constant))
        imp__reduced_term(g->r, IMP_OP_CONSTANT, 0, l->constant, NULL, NULL, 0);
    for (int k = 0; k < l->n; k++)
        if (!is_zero(g->r, l->input[k].c))
            imp__reduced_term(g->r, IMP_OP_INPUT, l->input[k].slot, l->input[k].c, NULL,
                              NULL, 0);
    l->constant = (imp_spec){0};
    l->n = 0;
}

static void input_add(struct reducing *g, int slot, imp_spec c)
{
    struct level *l = &g->level;
    for (int k = 0; k < l->n; k++)
        if (l->input[k].slot == slot) {
            l->input[k].c += c;
            return;
        }
    if (l->n == PENDING) level_end(g);
    l->input[l->n].slot = slot;
    l->input[l->n++].c = c;
}

/* ---- Terms and factors ----------------------------------------------------------- */

/* Where light leaves an emitter. */
struct leaving {
    struct imp_emission x;
    imp_v3 p;
};

/* The one input of those that are free in which f = sum in_j d_j is not 0; -1: f is 0, or
 * there are several (*several). d2: other derivatives that it has to do for; or NULL. */
static int single(const struct imp_reduction *of, const uint8_t *free, int n,
                  const imp_spec *d, const imp_spec *d2, bool *several)
{
    int found = -1;
    *several = false;
    for (int j = 0; j < n; j++) {
        bool counts = false;
        for (int c = 0; c < of->channels && free[j]; c++)
            counts |= (d && d[j][c] != 0) || (d2 && d2[j][c] != 0);
        if (!counts) continue;
        *several = found >= 0;
        if (*several) return -1;
        found = j;
    }
    return found;
}

/* c times the radiance of an emitter. `lit`: of the material at hand towards it, so that it
 * is no part of the level. */
static void radiance_add(struct reducing *g, int index, const struct leaving *at,
                         imp_spec c, const float lit[3])
{
    const struct imp_reduction *of = g->r->of;
    const struct imp_emitter *e = g->scene->emitters[index];
    struct imp_texcoord place = {
        .uv = {at->x.uv[0], at->x.uv[1]}, .p = at->p, .shape = e->shape};
    imp_spec in[IMP_INPUTS_MAX], d[IMP_INPUTS_MAX];
    bool several = true;
    int j = -1;
    if (is_zero(g->r, c)) return;
    if (of->emitter[index] == IMP_REDUCES_CONSTANT) {
        c *= imp__emitter_radiance(g->scene, index, &at->x, at->p, NULL);
        several = false;
    } else if (of->emitter[index] == IMP_REDUCES_LINEAR) {
        imp__emitter_place(e, &at->x, &place);
        imp__inputs_eval(e->input, e->n_in, &place, in);
        e->ops->eval_d(e, in, &at->x, d);
        j = single(of, of->free_emitter + (size_t)index * IMP_INPUTS_MAX, e->n_in, d,
                   NULL, &several);
        if (j >= 0) c *= d[j];
        else if (!several) return;
    }
    if (is_zero(g->r, c)) return;
    if (!several && j < 0) {
        if (lit) imp__reduced_term(g->r, IMP_OP_CONSTANT, 0, c, lit, NULL, 0);
        else g->level.constant += c;
    } else if (!several) {
        const int slot = of->emitter_slot[index] + j;
        if (lit) imp__reduced_term(g->r, IMP_OP_INPUT, slot, c, lit, NULL, 0);
        else input_add(g, slot, c);
    } else {
        const struct imp_emission *x = &at->x;
        const struct imp_reduced_emission data = {
            {(float)x->uv[0], (float)x->uv[1]},
            (float)x->dist,
            (float)x->cos_light,
            {(float)x->d[0], (float)x->d[1], (float)x->d[2]},
            {(float)at->p[0], (float)at->p[1], (float)at->p[2]}};
        imp__reduced_term(g->r, IMP_OP_EMITTER, index, c, lit, &data, sizeof data);
    }
}

static struct imp_reduced_place place_of(const struct imp_decision *d)
{
    struct imp_reduced_place at = {.shape = d->shape};
    memcpy(at.uv, d->uv, sizeof at.uv);
    memcpy(at.p, d->p, sizeof at.p);
    return at;
}

/* ---- A vertex -------------------------------------------------------------------- */

/* A vertex with what reducing it needs. */
struct vertex {
    const struct imp_decision *d;
    const struct imp_bsdf *bsdf; /* NULL: none */
    struct imp_texcoord at;
    imp_spec in[IMP_INPUTS_MAX];
    struct imp_dirs on, lit;
    struct leaving light;
    imp_spec light_w, step; /* of the light sample, and of the continuation without f */
};

static void vertex_look(const struct imp_scene *scene, const struct imp_decision *d,
                        struct vertex *v)
{
    v->d = d;
    v->bsdf = imp__decided_bsdf(scene, d);
    const struct imp_shape *shape = v->bsdf ? scene->shapes[d->shape] : NULL;
    v->at = (struct imp_texcoord){.uv = {d->uv[0], d->uv[1]},
                                  .p = imp__decided_v3(d->p),
                                  .shape = shape,
                                  .prim = d->located.prim};
    if (v->bsdf) imp__inputs_eval(v->bsdf->input, v->bsdf->n_in, &v->at, v->in);
    v->on = (struct imp_dirs){imp__decided_v3(d->wo), imp__decided_v3(d->wi), d->lobe, 0};
    v->lit = (struct imp_dirs){v->on.wo, imp__decided_v3(d->light.wi), IMP_SMOOTH, 0};
    if (d->connection == IMP_CONNECTED)
        v->light =
            (struct leaving){imp__light_emission(&d->light), imp__decided_v3(d->light.p)};
    v->light_w = imp__spec((double)d->light.weight);
    v->step = imp__spec(0);
    if (d->goes_on)
        v->step = imp__spec(1 / ((double)d->pdf * (double)d->survive)) *
                  imp__spec((double)d->passes);
}

static void met_add(struct reducing *g, const struct vertex *v)
{
    const struct imp_decision *d = v->d;
    if (d->met.emitter < 0) return;
    const struct leaving at = {
        {{d->uv[0], d->uv[1]}, d->met.dist, d->met.cos_light, imp__decided_v3(d->met.d)},
        imp__decided_v3(d->p)};
    radiance_add(g, d->met.emitter, &at, g->M * imp__spec((double)d->met.weight), NULL);
}

/* The material stays as it is. */
static void material_add(struct reducing *g, const struct vertex *v)
{
    const struct imp_decision *d = v->d;
    struct imp_reduced_material m = {.at = place_of(d)};
    const bool lit = d->connection == IMP_CONNECTED;
    if (!d->glows && !lit && !d->goes_on) return;
    memcpy(m.wo, d->wo, sizeof m.wo);
    imp__reduced_op(g->r, IMP_OP_MATERIAL, v->bsdf->index);
    imp__reduced_words(g->r, &m, sizeof m);
    if (d->glows)
        imp__reduced_term(g->r, IMP_OP_GLOW, 0, g->M * imp__spec((double)d->glow_weight),
                          NULL, NULL, 0);
    if (lit) radiance_add(g, d->light.emitter, &v->light, g->M * v->light_w, d->light.wi);
    g->M *= v->step;
    if (!d->goes_on) return;
    struct imp_reduced_on on = {.lobe = d->lobe};
    memcpy(on.wi, d->wi, sizeof on.wi);
    level_end(g);
    imp__reduced_op(g->r, IMP_OP_ON, 0);
    imp__reduced_words(g->r, &on, sizeof on);
}

/* What input `slot` of the material is at its place. */
static void factor_add(struct reducing *g, const struct vertex *v, int slot)
{
    const struct imp_reduction *of = g->r->of;
    struct imp_reduced_texels texels;
    struct imp__cell cell;
    level_end(g);
    for (;;) { /* a texture may be another input there */
        const struct imp_texture *t = of->slot[slot]->texture;
        const struct imp_input *is =
            t && !of->slot[slot]->scalar ? imp__checkerboard_input(t, &v->at) : NULL;
        if (!is) break;
        slot = of->inner[slot];
        while (of->slot[slot] != is) slot++;
    }
    const struct imp_input *input = of->slot[slot];
    if (!of->free_slot[slot]) {
        imp_spec value;
        imp__inputs_eval(&input, 1, &v->at, &value);
        g->M *= value;
    } else if (input->plain) {
        imp__reduced_op(g->r, IMP_OP_FACTOR, slot);
    } else if (of->texels[slot] && !input->scalar && !v->at.shape->by_triangle &&
               imp__bitmap_cell(input->texture, &v->at, &cell)) {
        for (int k = 0; k < 4; k++) texels.element[k] = cell.element[k < cell.n ? k : 0];
        texels.a = cell.a;
        texels.b = cell.b;
        imp__reduced_op(g->r, IMP_OP_TEXELS, slot);
        imp__reduced_words(g->r, &texels, sizeof texels);
    } else {
        const struct imp_reduced_place at = place_of(v->d);
        imp__reduced_op(g->r, IMP_OP_LOOKUP, slot);
        imp__reduced_words(g->r, &at, sizeof at);
    }
}

/* False: it is not of one input alone. */
static bool linear_add(struct reducing *g, const struct vertex *v)
{
    const struct imp_bsdf *b = v->bsdf;
    const struct imp_decision *d = v->d;
    const struct imp_reduction *of = g->r->of;
    const uint8_t *free = of->free_bsdf + (size_t)b->index * IMP_INPUTS_MAX;
    const bool lit = d->connection == IMP_CONNECTED;
    imp_spec de[IMP_INPUTS_MAX], df[IMP_INPUTS_MAX], dl[IMP_INPUTS_MAX];
    bool several;
    int glow = -1;
    if (d->glows) {
        b->ops->emit_d(b, v->in, &v->on.wo, de);
        glow = single(of, free, b->n_in, de, NULL, &several);
        if (several || (glow >= 0 && !b->input[glow]->plain)) return false;
    }
    if (lit) b->ops->eval_d(b, v->in, &v->lit, dl);
    if (d->goes_on) b->ops->eval_d(b, v->in, &v->on, df);
    const int j =
        single(of, free, b->n_in, lit ? dl : NULL, d->goes_on ? df : NULL, &several);
    if (several) return false;
    if (glow >= 0)
        input_add(g, of->bsdf_slot[b->index] + glow,
                  g->M * de[glow] * imp__spec((double)d->glow_weight));
    if (j < 0) {
        g->M = imp__spec(0);
        return true;
    }
    factor_add(g, v, of->bsdf_slot[b->index] + j);
    if (lit)
        radiance_add(g, d->light.emitter, &v->light, g->M * dl[j] * v->light_w, NULL);
    g->M *= d->goes_on ? df[j] * v->step : imp__spec(0);
    return true;
}

/* No input of its material may change. */
static void constant_add(struct reducing *g, const struct vertex *v)
{
    const struct imp_decision *d = v->d;
    imp_spec f = imp__spec(1);
    if (d->glows) {
        imp_spec glow;
        v->bsdf->ops->emit(v->bsdf, v->in, &v->on.wo, &glow);
        g->level.constant += g->M * glow * imp__spec((double)d->glow_weight);
    }
    if (d->connection == IMP_CONNECTED) {
        v->bsdf->ops->eval(v->bsdf, v->in, &v->lit, &f);
        radiance_add(g, d->light.emitter, &v->light, g->M * f * v->light_w, NULL);
    }
    f = imp__spec(1);
    if (v->bsdf && d->goes_on) v->bsdf->ops->eval(v->bsdf, v->in, &v->on, &f);
    g->M *= f * v->step;
}

/* ---- Walks ----------------------------------------------------------------------- */

static bool is_plain(const struct imp_record *record, const struct imp_record_walk *k)
{
    if (k->n_items > 0 || k->n != k->n_vertices) return false;
    for (uint32_t j = 0; j < k->n; j++) {
        const uint32_t *words = imp__record_words(record, k->first + j);
        struct imp_packed_head h;
        memcpy(&h, words, sizeof h);
        if (h.scatterer == IMP_AT_SENSOR || h.scatterer == IMP_AT_LIGHT ||
            h.scatterer == IMP_IN_MEDIUM)
            return false;
    }
    return true;
}

static void walk_reduce(struct reducing *g, const struct imp_record *record,
                        const struct imp_record_walk *k)
{
    struct vertex v;
    for (uint32_t j = 0; j < k->n && !is_zero(g->r, g->M); j++) {
        struct imp_decision d;
        imp__record_vertex(record, k->first + j, &d);
        vertex_look(g->scene, &d, &v);
        const enum imp_reduction_class class =
            v.bsdf && v.bsdf->index >= 0
                ? (enum imp_reduction_class)g->r->of->bsdf[v.bsdf->index]
                : IMP_REDUCES_CONSTANT;
        met_add(g, &v);
        if (class == IMP_REDUCES_CONSTANT) constant_add(g, &v);
        else if (class == IMP_REDUCES_NOT || !linear_add(g, &v)) material_add(g, &v);
    }
    level_end(g);
}

/* Factors at the end of a walk have nothing to multiply. */
static void end_trim(struct imp_reduced *r, size_t first)
{
    while (r->n_ops > first) {
        const struct imp_op *last = &r->ops[r->n_ops - 1];
        if (imp__op_is_term((enum imp_op_kind)last->kind)) return;
        r->n_words -= imp__op_words(*last);
        r->n_ops--;
    }
}

/* Are all numbers such as can be evaluated? */
static bool is_sound(const struct reducing *g, size_t first)
{
    for (int c = 0; c < g->r->of->channels; c++)
        if (!isfinite(g->M[c])) return false;
    return g->r->n_ops - first <= IMP_REDUCED_MOST;
}

void imp__reduced_make(const struct imp_reduction *of, const struct imp_record *record,
                       struct imp_reduced *out)
{
    struct imp_reduced r = {.of = of};
    r.n_walks = record->n_walks;
    r.walks = imp__alloc_raw(of->ctx, r.n_walks + 1, sizeof *r.walks);
    r.failed = !r.walks;
    for (size_t i = 0; i < r.n_walks && !r.failed; i++) {
        const struct imp_record_walk *k = imp__record_at(record, i);
        struct reducing g = {
            .r = &r, .scene = of->scene, .M = imp__spec(1), .level = {.n = 0}};
        const size_t op = r.n_ops, word = r.n_words;
        const bool plain = is_plain(record, k);
        if (plain) walk_reduce(&g, record, k);
        const bool whole = plain && !r.failed && is_sound(&g, op);
        if (!whole) {
            r.n_ops = op;
            r.n_words = word;
        }
        end_trim(&r, op);
        r.walks[i] =
            (struct imp_reduced_walk){(uint32_t)op & INT32_MAX, whole, (uint32_t)word};
    }
    if (r.failed) {
        imp__reduced_free(&r);
    } else {
        r.walks[r.n_walks] = (struct imp_reduced_walk){(uint32_t)r.n_ops & INT32_MAX,
                                                       true, (uint32_t)r.n_words};
        r.ops = imp__reduced_trimmed(of->ctx, r.ops, r.n_ops, sizeof *r.ops);
        r.words = imp__reduced_trimmed(of->ctx, r.words, r.n_words, sizeof *r.words);
    }
    *out = r;
}
