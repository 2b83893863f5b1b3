/* SPDX-License-Identifier: Apache-2.0
 *
 * Derivatives of a reduced walk. The sweep goes back: with P the factors before an op, and R
 * the sum of what stands behind a factor v,
 *
 *     d L/d v = P R,      R <- R v,      and of a term c v     d L/d v = P c,   R <- R + c v
 */
#include "reduced_read.h"

static void texels_scatter(const struct imp_reduction *all, struct imp_op op,
                           const uint32_t *words, imp_spec bar, struct imp_sink *sink)
{
    const int param = all->slot[op.index]->texture->param;
    const int channels = all->texel_channels[op.index];
    struct imp_reduced_texels t;
    double w[4];
    memcpy(&t, words, sizeof t);
    imp__reduced_weights(&t, w);
    for (int k = 0; k < 4; k++) {
        const imp_spec part = bar * w[k];
        if (w[k] != 0) sink->add(sink, param, t.element[k], channels, &part);
    }
}

static imp_spec texels_tangent(const struct imp_reduction *all, struct imp_op op,
                               const uint32_t *words, imp_dot_fn *dot, const void *x_dot)
{
    const int param = all->slot[op.index]->texture->param;
    const size_t n = all->texel_channels[op.index];
    struct imp_reduced_texels t;
    imp_spec sum = {0};
    double w[4];
    memcpy(&t, words, sizeof t);
    imp__reduced_weights(&t, w);
    for (int k = 0; k < 4; k++) {
        imp_spec d = imp__spec(dot(x_dot, param, t.element[k]));
        for (size_t c = 1; c < n; c++) d[c] = dot(x_dot, param, t.element[k] + c);
        sum += d * w[k];
    }
    return sum;
}

/* Factors before each op, and where the last of what was seen is. */
static const struct imp_reduced_seen *factors(const struct imp_reduced_of *of,
                                              const struct imp_op *op, imp_spec P,
                                              imp_spec *before)
{
    const struct imp_input *const *slot = of->all->of->slot;
    const struct imp_reduced_seen *seen = of->seen;
    for (uint32_t i = 0; i < of->n_ops; i++) {
        before[i] = P;
        switch ((enum imp_op_kind)op[i].kind) {
        case IMP_OP_FACTOR: P *= slot[op[i].index]->value; break;
        case IMP_OP_TEXELS:
        case IMP_OP_LOOKUP:
        case IMP_OP_ON: P *= (seen++)->value; break;
        case IMP_OP_LIT:
        case IMP_OP_MATERIAL: seen++; break;
        default: break;
        }
    }
    return seen;
}

/* What the sweep has found of the inputs of the material at hand. */
struct material_bar {
    imp_spec bar[IMP_INPUTS_MAX];
    bool any;
};
static void bar_add(struct material_bar *b, const struct imp_reduced_at_hand *m,
                    const imp_spec *d, imp_spec by)
{
    const int n = m->bsdf->n_in;
    for (int j = 0; j < n; j++) b->bar[j] = b->any ? b->bar[j] + d[j] * by : d[j] * by;
    b->any = true;
}

static void bars_scatter(const struct imp_scene *scene,
                         const struct imp_reduced_at_hand *m,
                         const struct material_bar *b, struct imp_sink *sink)
{
    const struct imp_input *const *input = m->bsdf->input;
    const int n = m->bsdf->n_in;
    if (imp_likely(m->plain)) {
        for (int j = 0; j < n; j++) imp__plain_scatter(input[j], &b->bar[j], sink);
        return;
    }
    const struct imp_texcoord at = imp__reduced_material_at(scene, m);
    imp__inputs_scatter(input, n, &at, b->bar, sink);
}

/* By the inputs of a material: those that are there, or into d [n_in]. */
static const imp_spec *derivatives(const struct imp_reduced_seen *seen,
                                   const struct imp_dirs *dirs, imp_spec *d)
{
    const struct imp_reduced_at_hand *m = seen->material;
    if (seen->d) return seen->d;
    m->bsdf->ops->eval_d(m->bsdf, m->in, dirs, d);
    return d;
}

static void emitter_sweep(const struct imp_tracer *tracer, struct imp_op op,
                          const uint32_t *words, imp_spec bar, struct imp_sink *sink)
{
    imp_v3 p;
    struct imp_emission x = imp__reduced_emission_of(words, &p);
    struct imp_texcoord at = {.uv = {x.uv[0], x.uv[1]}, .p = p};
    imp__emitter_scatter(tracer, (int)op.index, &x, &at, bar, sink);
}

void imp__reduced_sweep(const struct imp_tracer *tracer, const struct imp_walk *walk,
                        imp_spec adjoint, struct imp_sink *sink)
{
    const struct imp_reduced_of *of = (const struct imp_reduced_of *)walk->reduced;
    const struct imp_reduction *all = of->all->of;
    const struct imp_active *active = tracer->active;
    const struct imp_op *op = of->all->ops + of->op;
    const uint32_t *words = of->all->words + of->word;
    imp_spec P[IMP_REDUCED_MOST], R = {0}, d[IMP_INPUTS_MAX];
    const struct imp_reduced_seen *seen = factors(of, op, adjoint, P);
    struct material_bar bars;
    bars.any = false;
    for (uint32_t i = of->n_ops; i-- > 0;) {
        const struct imp_op o = op[i];
        const bool is_term = o.kind < IMP_OP_FACTOR;
        const bool is_lit = is_term && i > 0 && op[i - 1].kind == IMP_OP_LIT;
        const struct imp_input *input;
        const uint32_t *end = words;
        imp_spec bar = P[i], term = {0};
        words -= imp__op_words(o);
        if (imp_unlikely(is_lit)) bar *= (--seen)->value;
        switch ((enum imp_op_kind)o.kind) {
        case IMP_OP_FACTOR:
            input = all->slot[o.index];
            if (active->base[input->param] >= 0) {
                bar *= R;
                imp__plain_scatter(input, &bar, sink);
            }
            R *= input->value;
            break;
        case IMP_OP_INPUT: {
            const imp_spec c = imp__reduced_number(o, end);
            input = all->slot[o.index];
            if (active->base[input->param] >= 0) {
                bar *= c;
                imp__plain_scatter(input, &bar, sink);
            }
            term = c * input->value;
            break;
        }
        case IMP_OP_CONSTANT: term = imp__reduced_number(o, end); break;
        case IMP_OP_TEXELS:
            seen--;
            if (active->base[all->slot[o.index]->texture->param] >= 0)
                texels_scatter(all, o, words, bar * R, sink);
            R *= seen->value;
            break;
        case IMP_OP_LOOKUP: {
            seen--;
            const struct imp_bsdf *b = all->owner[o.index];
            if (active->bsdf[b->index]) {
                const struct imp_texcoord at = imp__reduced_lookup_at(all->scene, words);
                bar *= R;
                imp__inputs_scatter(&all->slot[o.index], 1, &at, &bar, sink);
            }
            R *= seen->value;
            break;
        }
        case IMP_OP_EMITTER: {
            imp_v3 p;
            const struct imp_emission x = imp__reduced_emission_of(words, &p);
            const imp_spec c = imp__reduced_number(o, end);
            term = c * imp__emitter_radiance(all->scene, (int)o.index, &x, p, NULL);
            if (active->emitter[o.index]) emitter_sweep(tracer, o, words, bar * c, sink);
            break;
        }
        case IMP_OP_MATERIAL: {
            const struct imp_reduced_at_hand *m = (--seen)->material;
            if (bars.any) bars_scatter(all->scene, m, &bars, sink);
            bars.any = false;
            break;
        }
        case IMP_OP_ON: {
            const struct imp_reduced_at_hand *m = (--seen)->material;
            if (active->bsdf[m->bsdf->index] && !imp__is_zero(R)) {
                const struct imp_dirs dirs = imp__reduced_on_dirs(m, words);
                bar_add(&bars, m, derivatives(seen, &dirs, d), bar * R);
            }
            R *= seen->value;
            break;
        }
        case IMP_OP_GLOW: {
            const struct imp_reduced_at_hand *m =
                seen[-1].material; /* of anything before it */
            const imp_spec c = imp__reduced_number(o, end);
            imp_spec glow;
            m->bsdf->ops->emit(m->bsdf, m->in, &m->wo, &glow);
            term = c * glow;
            if (active->bsdf[m->bsdf->index]) {
                m->bsdf->ops->emit_d(m->bsdf, m->in, &m->wo, d);
                bar_add(&bars, m, d, bar * c);
            }
            break;
        }
        case IMP_OP_LIT: break; /* with its term */
        }
        if (imp_unlikely(is_lit)) {
            const struct imp_reduced_at_hand *m = seen->material;
            i--;
            words -= imp__op_words(op[i]);
            if (active->bsdf[m->bsdf->index]) {
                const struct imp_dirs dirs = imp__reduced_lit_dirs(m, words);
                bar_add(&bars, m, derivatives(seen, &dirs, d), P[i] * term);
            }
            term *= seen->value;
        }
        if (is_term) R += term;
    }
}

static imp_spec material_tangent(const struct imp_tracer *tracer,
                                 const struct imp_reduced_seen *seen,
                                 const struct imp_dirs *dirs, imp_dot_fn *dot,
                                 const void *x_dot, imp_spec *in_dot, imp_spec *room)
{
    const struct imp_reduced_at_hand *m = seen->material;
    imp_spec sum = {0};
    if (!tracer->active->bsdf[m->bsdf->index]) return sum;
    const struct imp_texcoord at = imp__reduced_material_at(tracer->scene, m);
    imp__inputs_tangent(m->bsdf->input, m->bsdf->n_in, &at, dot, x_dot, in_dot);
    const imp_spec *d = derivatives(seen, dirs, room);
    for (int j = 0; j < m->bsdf->n_in; j++) sum += d[j] * in_dot[j];
    return sum;
}

/* Forward mode: R and its derivative, from the last op to the first. */
imp_spec imp__reduced_tangent(const struct imp_tracer *tracer,
                              const struct imp_walk *walk, imp_dot_fn *dot,
                              const void *x_dot)
{
    const struct imp_reduced_of *of = (const struct imp_reduced_of *)walk->reduced;
    const struct imp_reduction *all = of->all->of;
    const struct imp_op *op = of->all->ops + of->op;
    const uint32_t *words = of->all->words + of->word;
    imp_spec P[IMP_REDUCED_MOST], R = {0}, R_dot = {0};
    imp_spec d[IMP_INPUTS_MAX], in_dot[IMP_INPUTS_MAX];
    const struct imp_reduced_seen *seen = factors(of, op, imp__spec(1), P);
    for (uint32_t i = of->n_ops; i-- > 0;) {
        const struct imp_op o = op[i];
        const bool is_term = o.kind < IMP_OP_FACTOR;
        const bool is_lit = is_term && i > 0 && op[i - 1].kind == IMP_OP_LIT;
        const uint32_t *end = words;
        imp_spec term = {0}, term_dot = {0}, v_dot = {0};
        words -= imp__op_words(o);
        if (is_lit) seen--;
        switch ((enum imp_op_kind)o.kind) {
        case IMP_OP_TEXELS:
            seen--;
            v_dot = texels_tangent(all, o, words, dot, x_dot);
            R_dot = R_dot * seen->value + v_dot * R;
            R *= seen->value;
            break;
        case IMP_OP_FACTOR:
        case IMP_OP_LOOKUP: {
            const bool plain = o.kind == IMP_OP_FACTOR;
            const struct imp_texcoord at =
                plain ? (struct imp_texcoord){.uv = {0}}
                      : imp__reduced_lookup_at(all->scene, words);
            const imp_spec v = plain ? all->slot[o.index]->value : (--seen)->value;
            imp__inputs_tangent(&all->slot[o.index], 1, &at, dot, x_dot, &v_dot);
            R_dot = R_dot * v + v_dot * R;
            R *= v;
            break;
        }
        case IMP_OP_INPUT: {
            const struct imp_texcoord at = {.uv = {0}};
            const imp_spec c = imp__reduced_number(o, end);
            imp__inputs_tangent(&all->slot[o.index], 1, &at, dot, x_dot, &v_dot);
            term = c * all->slot[o.index]->value;
            term_dot = c * v_dot;
            break;
        }
        case IMP_OP_CONSTANT: term = imp__reduced_number(o, end); break;
        case IMP_OP_EMITTER: {
            imp_v3 p;
            const struct imp_emission x = imp__reduced_emission_of(words, &p);
            const struct imp_texcoord at = {.uv = {x.uv[0], x.uv[1]}, .p = p};
            const imp_spec c = imp__reduced_number(o, end);
            term = c * imp__emitter_radiance(all->scene, (int)o.index, &x, p, NULL);
            if (tracer->active->emitter[o.index])
                term_dot =
                    c * imp__emitter_tangent(tracer, (int)o.index, x, at, dot, x_dot);
            break;
        }
        case IMP_OP_MATERIAL: seen--; break;
        case IMP_OP_ON: {
            const struct imp_dirs dirs = imp__reduced_on_dirs((--seen)->material, words);
            v_dot = material_tangent(tracer, seen, &dirs, dot, x_dot, in_dot, d);
            R_dot = R_dot * seen->value + v_dot * R;
            R *= seen->value;
            break;
        }
        case IMP_OP_GLOW: {
            const struct imp_reduced_at_hand *m = seen[-1].material;
            const imp_spec c = imp__reduced_number(o, end);
            imp_spec glow;
            m->bsdf->ops->emit(m->bsdf, m->in, &m->wo, &glow);
            term = c * glow;
            if (!tracer->active->bsdf[m->bsdf->index]) break;
            const struct imp_texcoord at = imp__reduced_material_at(all->scene, m);
            imp__inputs_tangent(m->bsdf->input, m->bsdf->n_in, &at, dot, x_dot, in_dot);
            m->bsdf->ops->emit_d(m->bsdf, m->in, &m->wo, d);
            for (int j = 0; j < m->bsdf->n_in; j++) term_dot += c * d[j] * in_dot[j];
            break;
        }
        case IMP_OP_LIT: break; /* with its term */
        }
        if (is_lit) {
            words -= imp__op_words(op[--i]);
            const struct imp_dirs dirs = imp__reduced_lit_dirs(seen->material, words);
            v_dot = material_tangent(tracer, seen, &dirs, dot, x_dot, in_dot, d);
            term_dot = term_dot * seen->value + v_dot * term;
            term *= seen->value;
        }
        R += term;
        R_dot += term_dot;
    }
    return R_dot;
}
