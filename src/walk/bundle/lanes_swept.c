/* SPDX-License-Identifier: Apache-2.0
 *
 * What a sweep takes of vertices that were made in lanes (swept.h). */
#include "swept.h"

/* In the arena, aligned as registers are. */
static void *wide_take(struct imp_arena *arena, size_t bytes)
{
    const size_t slack = _Alignof(imp_wide) > 32 ? _Alignof(imp_wide) - 32 : 0;
    unsigned char *p = imp__arena_take(arena, bytes + slack, 1);
    return p ? p + (-(uintptr_t)p & (_Alignof(imp_wide) - 1)) : NULL;
}

/* All of a kind's derivatives in lanes, times `by`, those of active inputs. */
static void derivatives(const struct imp_wide_color *d, uint64_t inputs, int colors,
                        const imp_wide by[4], imp_wide *out)
{
    for (; inputs; inputs &= inputs - 1) {
        const int j = __builtin_ctzll(inputs);
        for (int c = 0; c < colors; c++) *out++ = d[j].c[c] * by[c];
    }
}

/* Luminances and components of others have derivatives, but no bit among the active inputs: with those of
 * the luminances of active ones. */
static uint64_t with_luminances(const struct imp_bsdf *b, uint64_t active)
{
    uint64_t all = active;
    for (int j = 0; j < b->n_in; j++)
        if (b->input[j]->luminance)
            all |= (active >> (j - b->input[j]->luminance) & 1) << j;
    return all;
}
static bool has_components(const struct imp_bsdf *b)
{
    for (int j = 0; j < b->n_in; j++)
        if (b->input[j]->component) return true;
    return false;
}

/* False: the kind has none in lanes. */
static bool derivatives_keep(struct imp_arena *arena, const struct imp_bin *bin,
                             const struct imp_lanes_vertices *v, const imp_wide lit[4],
                             const struct imp_lanes_lit *light,
                             const struct imp_lanes_step *step, int colors,
                             struct imp_swept_lanes *out)
{
    struct imp_wide_color d[IMP_INPUTS_MAX];
    const imp_wide scale[4] = {step->scale, step->scale, step->scale, step->scale};
    const imp_wide_lobe smooth = imp__wide_smooth();
    const size_t n = (size_t)__builtin_popcountll(out->inputs) * (size_t)colors;
    if (!bin->kernel || !bin->kernel->eval_d || !out->inputs || has_components(bin->bsdf))
        return false;
    if (out->lit) {
        if (!bin->kernel->eval_d(bin->bsdf, v->in, &v->wo, &light->wi, &smooth, colors,
                                 d))
            return false;
        out->by_light = wide_take(arena, n * sizeof(imp_wide));
        if (out->by_light) derivatives(d, out->inputs, colors, lit, out->by_light);
    }
    if (out->on) {
        if (!bin->kernel->eval_d(bin->bsdf, v->in, &v->wo, &step->wi, &step->lobe, colors,
                                 d))
            return false;
        out->by_step = wide_take(arena, n * sizeof(imp_wide));
        if (out->by_step) derivatives(d, out->inputs, colors, scale, out->by_step);
    }
    return true;
}

static void dirs_keep(struct imp_arena *arena, const struct imp_bin *bin,
                      const struct imp_lanes_vertices *v, const imp_wide lit[4],
                      const struct imp_lanes_lit *light,
                      const struct imp_lanes_step *step, int colors,
                      struct imp_swept_lanes *out)
{
    const int n_in = bin->bsdf->n_in;
    struct imp_swept_dirs *d =
        wide_take(arena, sizeof *d + (size_t)(IMP_WIDE_LANES * n_in) * sizeof *d->in);
    out->by_light = out->by_step = NULL;
    out->dirs = d;
    if (!d) return;
    d->wo = v->wo;
    d->wi = step->wi;
    d->light = light->wi;
    d->lobe = step->lobe;
    d->scale = step->scale;
    for (int c = 0; c < colors; c++) d->lit.c[c] = lit[c];
    for (unsigned left = out->lit | out->on; left; left &= left - 1) {
        const int k = __builtin_ctz(left);
        for (int j = 0; j < n_in; j++)
            d->in[k * n_in + j] = bin->kernel ? imp__color_lane(&v->in[j], 4, k)
                                              : v->each[k * v->stride + j];
    }
}

static void place_keep(struct imp_arena *arena, const struct imp_depth *d,
                       const struct imp_lanes_vertices *v, struct imp_swept_lanes *out)
{
    struct imp_swept_place *p = wide_take(arena, sizeof *p);
    out->place = p;
    if (!p) return;
    for (int j = 0; j < 2; j++) p->uv[j] = imp__wide_decide(v->x.uv[j]);
    p->p = imp__wide3_decide(v->x.p);
    for (int k = 0; k < IMP_WIDE_LANES; k++) {
        const int i = v->order[k];
        p->shape[k] = d->hits->shape[i];
        p->prim[k] =
            d->bundle->tracer->scene->shapes[p->shape[k]]->geometry == IMP_TRIANGLES
                ? d->hits->prim[i]
                : 0;
    }
}

/* False: some texture has no such form. */
static bool texels_keep(struct imp_arena *arena, const struct imp_bin *bin,
                        const struct imp_lanes_vertices *v, struct imp_swept_lanes *out)
{
    const struct imp_input *const *input = bin->bsdf->input;
    const imp_wide uv[2] = {imp__wide_decide(v->x.uv[0]), imp__wide_decide(v->x.uv[1])};
    size_t n = 0;
    if (!bin->texels) return false;
    for (uint64_t left = out->inputs; left; left &= left - 1)
        n += !input[__builtin_ctzll(left)]->plain;
    struct imp_wide_texels *t = wide_take(arena, n * sizeof *t);
    out->texels = t;
    if (!t) return true;
    for (uint64_t left = out->inputs; left; left &= left - 1) {
        const struct imp_input *i = input[__builtin_ctzll(left)];
        if (i->plain) continue;
        const struct imp_texture_lanes *lanes = imp__texture_lanes(i->texture);
        if (!lanes->texels || !lanes->texels(i->texture, uv, i->scalar, t++))
            return false;
    }
    return true;
}

static void light_keep(struct imp_arena *arena, const struct imp_lanes_lit *lit,
                       int colors, struct imp_swept_lanes *out)
{
    const struct imp_wide_light *x = &lit->light.at;
    const imp_wide3 none = imp__wide3_of((imp_v3){0});
    struct imp_swept_light *l = wide_take(arena, sizeof *l);
    out->light = l;
    if (!l) return;
    for (int j = 0; j < 2; j++) l->uv[j] = imp__wide_decide(x->uv[j]);
    l->dist = imp__wide_decide(x->dist);
    l->cos_light = imp__wide_decide(x->cos_light);
    l->weight = lit->weight;
    l->d = imp__wide3_decide(imp__wide3_opposite(x->wi));
    l->p = imp__wide3_decide(imp__wide3_choose(lit->light.far, none, x->p));
    for (int c = 0; c < colors; c++) l->f.c[c] = lit->f.c[c];
    for (int k = 0; k < IMP_WIDE_LANES; k++) {
        l->emitter[k] = lit->light.light[k];
        l->prim[k] = x->prim[k];
    }
}

static bool is_active(const struct imp_bundle *b, const struct imp_lanes_lit *lit)
{
    for (unsigned left = b->swept->lights ? lit->on : 0; left; left &= left - 1)
        if (b->tracer->active->emitter[lit->light.light[__builtin_ctz(left)]])
            return true;
    return false;
}

/* NULL: no memory. */
static struct imp_swept_lanes *lanes_keep(struct imp_depth *d, const struct imp_bin *bin,
                                          const struct imp_lanes_vertices *v,
                                          const struct imp_lanes_lit *lit,
                                          const struct imp_lanes_step *step)
{
    const struct imp_bundle *b = d->bundle;
    const struct imp_active *active = b->tracer->active;
    struct imp_arena *arena = d->lone->step.arena;
    const int material = bin->bsdf->index;
    const bool differs = active && material >= 0 && active->bsdf[material],
               light = is_active(b, lit);
    if (!differs && !light) return &b->swept->nothing;
    struct imp_swept_lanes *out = imp__arena_take(arena, 1, sizeof *out);
    if (!out) return NULL;
    *out = (struct imp_swept_lanes){
        .bsdf = bin->bsdf,
        .lit = lit->on,
        .on = step->on,
        .inputs = differs ? with_luminances(bin->bsdf, bin->derivative) : 0};
    if (light) light_keep(arena, lit, b->colors, out);
    if (!differs) return out;
    imp_wide by[4];
    for (int c = 0; c < b->colors; c++) by[c] = lit->light.radiance.c[c] * lit->weight;
    if (!derivatives_keep(arena, bin, v, by, lit, step, b->colors, out))
        dirs_keep(arena, bin, v, by, lit, step, b->colors, out);
    if (!out->dirs && b->colors == 3 && out->inputs == bin->derivative)
        out->numbers = bin->plain || texels_keep(arena, bin, v, out);
    if (!out->numbers && !bin->plain) place_keep(arena, d, v, out);
    return out;
}

void imp__lanes_keep(struct imp_depth *d, const struct imp_bin *bin,
                     const struct imp_lanes_vertices *v, const struct imp_lanes_lit *lit,
                     const struct imp_lanes_step *step)
{
    struct imp_bundle *b = d->bundle;
    struct imp_swept_depth *to = b->swept->last;
    struct imp_swept_lanes *of = lanes_keep(d, bin, v, lit, step);
    for (unsigned left = v->on; left; left &= left - 1) {
        const int k = __builtin_ctz(left), walk = v->walk[k];
        b->swept->count[walk]++;
        to->place[walk] = v->at + k;
        to->of[v->at + k] = of;
        to->lane[v->at + k] = (int8_t)k;
    }
}

void imp__lanes_keep_sky(struct imp_depth *d, const int32_t *order, int n, int at,
                         int light, const imp_wide3 *wi, const imp_wide *weight)
{
    struct imp_bundle *b = d->bundle;
    struct imp_arena *arena = d->lone->step.arena;
    struct imp_swept_depth *to = b->swept->last;
    struct imp_swept_lanes *of = NULL;
    if (b->swept->lights && b->tracer->active->emitter[light]) {
        of = imp__arena_take(arena, 1, sizeof *of);
        struct imp_swept_light *l = wide_take(arena, sizeof *l);
        if (of && l) {
            *of = (struct imp_swept_lanes){.light = l};
            l->emitter[0] = light;
            l->p = imp__wide3_decide(*wi);
            l->d = imp__wide3_decide(imp__wide3_opposite(*wi));
            l->weight = imp__wide_decide(*weight);
        }
    }
    for (int k = 0; k < n; k++) {
        const int walk = d->rays->walk[order[k]];
        b->swept->count[walk]++;
        to->place[walk] = at + k;
        to->of[at + k] = of;
        to->lane[at + k] = (int8_t)k;
    }
}
