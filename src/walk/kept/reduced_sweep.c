/* SPDX-License-Identifier: Apache-2.0
 *
 * Derivatives of a reduced walk, from its last op to its first: with P the factors before an op,
 * and R the sum of what is behind a factor v,
 *
 *     d L/d v = P R,      R <- R v,      and of a term c v     d L/d v = P c,   R <- R + c v
 *
 * Each is a piece, as those of vertices are (path/vertex_pieces.h): the visitor lists them, and
 * a table takes them, in a sink or along a direction. */
#include "reduced_read.h"

/* ---- The visitor ----------------------------------------------------------------- */

/* What becomes of a piece v whose adjoint is bar = d L/d v. */
struct taking {
    /* v: the number of an input; four texels of it; its value at a place. */
    void (*number)(void *taker, const struct imp_input *input, imp_spec bar);
    void (*texels)(void *taker, const struct imp_reduction *all, int slot,
                   const uint32_t *words, imp_spec bar);
    void (*lookup)(void *taker, const struct imp_input *const *input,
                   const struct imp_texcoord *at, imp_spec bar);
    /* The radiance of an emitter. */
    void (*emitter)(void *taker, int emitter, struct imp_emission *x,
                    struct imp_texcoord *at, imp_spec bar);
    /* A value of material m, with its derivatives d; then that was all of it. */
    void (*material)(void *taker, const struct imp_reduced_at_hand *m, const imp_spec *d,
                     imp_spec bar);
    void (*material_end)(void *taker, const struct imp_reduced_at_hand *m);
};

#define PIECES_INLINE static inline __attribute__((always_inline))

/* Goes from op to op, last to first, with the words of each and what was seen of it. */
struct cursor {
    const struct imp_op *ops;
    uint32_t i;                  /* of the op */
    const uint32_t *words, *end; /* of the op */
    const struct imp_reduced_seen
        *seen; /* of the op, if something was; else of one before */
};

/* At its end; before: the factors before each op. */
PIECES_INLINE struct cursor cursor_begin(const struct imp_reduced_of *of, imp_spec P,
                                         imp_spec *before)
{
    const struct imp_input *const *slot = of->all->of->slot;
    const struct imp_op *ops = of->all->ops + of->op;
    const struct imp_reduced_seen *seen = of->seen;
    for (uint32_t i = 0; i < of->n_ops; i++) {
        const struct imp_op op = ops[i];
        before[i] = P;
        switch ((enum imp_op_kind)op.kind) {
        case IMP_OP_FACTOR: P *= slot[op.index]->value; break;
        case IMP_OP_TEXELS:
        case IMP_OP_LOOKUP:
        case IMP_OP_ON: P *= (seen++)->value; break;
        case IMP_OP_MATERIAL: seen++; break;
        default:
            if (op.lit) seen++; /* where nothing was seen it is NULL */
        }
    }
    const uint32_t *end = of->all->words + of->word;
    return (struct cursor){ops, of->n_ops, end, end, seen};
}

PIECES_INLINE bool cursor_back(struct cursor *c, struct imp_op *op)
{
    if (c->i == 0) return false;
    *op = c->ops[--c->i];
    c->end = c->words;
    c->words -= imp__op_words(*op);
    return true;
}

/* A value of the material that was seen, for directions. */
PIECES_INLINE void material_piece(const struct taking *to, void *taker,
                                  const struct imp_active *active,
                                  const struct imp_reduced_seen *seen,
                                  const struct imp_dirs *dirs, imp_spec bar)
{
    const struct imp_reduced_at_hand *m = seen->material;
    imp_spec own[IMP_INPUTS_MAX];
    const imp_spec *d = seen->d;
    if (!active->bsdf[m->bsdf->index]) return;
    if (!d) {
        m->bsdf->ops->eval_d(m->bsdf, m->in, dirs, own);
        d = own;
    }
    to->material(taker, m, d, bar);
}

/* Pieces of a term, and its value. kind: the op's, constant where this is called. */
PIECES_INLINE imp_spec term_pieces(const struct taking *to, void *taker,
                                   const struct imp_tracer *tracer,
                                   const struct imp_reduction *all, enum imp_op_kind kind,
                                   struct cursor *c, struct imp_op o, imp_spec P)
{
    const struct imp_active *active = tracer->active;
    const imp_spec number = imp__reduced_number(o, c->end);
    imp_spec bar = P;
    if (imp_unlikely(o.lit)) bar *= (--c->seen)->value;
    const struct imp_reduced_at_hand *m = NULL;
    if (kind == IMP_OP_GLOW) m = c->seen[-1].material;
    imp_spec term = imp__reduced_term_value(all, kind, o, c->words, c->end, m);
    if (kind == IMP_OP_INPUT) {
        const struct imp_input *input = all->slot[o.index];
        if (active->base[input->param] >= 0) to->number(taker, input, bar * number);
    } else if (kind == IMP_OP_EMITTER && active->emitter[o.index]) {
        imp_v3 p;
        struct imp_emission x =
            imp__reduced_emission_of(c->words + (o.lit ? IMP_OP_TOWARDS : 0), &p);
        struct imp_texcoord at = {.uv = {x.uv[0], x.uv[1]}, .p = p};
        to->emitter(taker, (int)o.index, &x, &at, bar * number);
    } else if (kind == IMP_OP_GLOW && active->bsdf[m->bsdf->index]) {
        imp_spec d[IMP_INPUTS_MAX];
        m->bsdf->ops->emit_d(m->bsdf, m->in, &m->wo, d);
        to->material(taker, m, d, bar * number);
    }
    if (imp_unlikely(o.lit)) {
        const struct imp_dirs dirs = imp__reduced_lit_dirs(c->seen->material, c->words);
        material_piece(to, taker, active, c->seen, &dirs, P * term);
        term *= c->seen->value;
    }
    return term;
}

PIECES_INLINE void pieces(const struct taking *to, void *taker,
                          const struct imp_tracer *tracer, const struct imp_walk *walk,
                          imp_spec adjoint)
{
    const struct imp_reduced_of *of = (const struct imp_reduced_of *)walk->reduced;
    const struct imp_reduction *all = of->all->of;
    const struct imp_active *active = tracer->active;
    imp_spec before[IMP_REDUCED_MOST], R = {0};
    struct imp_op o;
    struct cursor c = cursor_begin(of, adjoint, before);
#define TERM(kind)                                                                       \
    R += term_pieces(to, taker, tracer, all, kind, &c, o, P);                            \
    break
    while (cursor_back(&c, &o)) {
        const imp_spec P = before[c.i];
        switch ((enum imp_op_kind)o.kind) {
        case IMP_OP_FACTOR: {
            const struct imp_input *input = all->slot[o.index];
            if (active->base[input->param] >= 0) to->number(taker, input, P * R);
            R *= input->value;
            break;
        }
        case IMP_OP_TEXELS:
            c.seen--;
            if (active->base[all->slot[o.index]->texture->param] >= 0)
                to->texels(taker, all, (int)o.index, c.words, P * R);
            R *= c.seen->value;
            break;
        case IMP_OP_LOOKUP:
            c.seen--;
            if (active->bsdf[all->owner[o.index]->index]) {
                const struct imp_texcoord at =
                    imp__reduced_lookup_at(all->scene, c.words);
                to->lookup(taker, &all->slot[o.index], &at, P * R);
            }
            R *= c.seen->value;
            break;
        case IMP_OP_ON:
            c.seen--;
            if (!imp__is_zero(R)) {
                const struct imp_dirs dirs =
                    imp__reduced_on_dirs(c.seen->material, c.words);
                material_piece(to, taker, active, c.seen, &dirs, P * R);
            }
            R *= c.seen->value;
            break;
        case IMP_OP_MATERIAL: to->material_end(taker, (--c.seen)->material); break;
        case IMP_OP_CONSTANT: TERM(IMP_OP_CONSTANT);
        case IMP_OP_INPUT: TERM(IMP_OP_INPUT);
        case IMP_OP_EMITTER: TERM(IMP_OP_EMITTER);
        case IMP_OP_GLOW: TERM(IMP_OP_GLOW);
        }
    }
#undef TERM
}

/* ---- Reverse --------------------------------------------------------------------- */

struct reverse {
    const struct imp_tracer *tracer;
    struct imp_sink *sink;
    imp_spec bar[IMP_INPUTS_MAX]; /* of the inputs of the material at hand */
    bool any;
};

static inline void reverse_number(void *taker, const struct imp_input *input,
                                  imp_spec bar)
{
    const struct reverse *r = taker;
    imp__plain_scatter(input, &bar, r->sink);
}

static void reverse_texels(void *taker, const struct imp_reduction *all, int slot,
                           const uint32_t *words, imp_spec bar)
{
    const struct reverse *r = taker;
    const int param = all->slot[slot]->texture->param;
    const int channels = all->texel_channels[slot];
    struct imp_reduced_texels t;
    double w[4];
    memcpy(&t, words, sizeof t);
    imp__reduced_weights(&t, w);
    for (int k = 0; k < 4; k++) {
        const imp_spec part = bar * w[k];
        if (w[k] != 0) r->sink->add(r->sink, param, t.element[k], channels, &part);
    }
}

static void reverse_lookup(void *taker, const struct imp_input *const *input,
                           const struct imp_texcoord *at, imp_spec bar)
{
    const struct reverse *r = taker;
    imp__inputs_scatter(input, 1, at, &bar, r->sink);
}

static void reverse_emitter(void *taker, int emitter, struct imp_emission *x,
                            struct imp_texcoord *at, imp_spec bar)
{
    const struct reverse *r = taker;
    imp__emitter_scatter(r->tracer, emitter, x, at, bar, r->sink);
}

static inline void reverse_material(void *taker, const struct imp_reduced_at_hand *m,
                                    const imp_spec *d, imp_spec bar)
{
    struct reverse *r = taker;
    const int n = m->bsdf->n_in;
    for (int j = 0; j < n; j++) r->bar[j] = r->any ? r->bar[j] + d[j] * bar : d[j] * bar;
    r->any = true;
}

static inline void reverse_material_end(void *taker, const struct imp_reduced_at_hand *m)
{
    struct reverse *r = taker;
    const struct imp_input *const *input = m->bsdf->input;
    const int n = m->bsdf->n_in;
    if (!r->any) return;
    r->any = false;
    if (imp_likely(m->plain)) {
        for (int j = 0; j < n; j++) imp__plain_scatter(input[j], &r->bar[j], r->sink);
        return;
    }
    const struct imp_texcoord at = imp__reduced_material_at(r->tracer->scene, m);
    imp__inputs_scatter(input, n, &at, r->bar, r->sink);
}

void imp__reduced_sweep(const struct imp_tracer *tracer, const struct imp_walk *walk,
                        imp_spec adjoint, struct imp_sink *sink)
{
    static const struct taking reverse = {reverse_number,   reverse_texels,
                                          reverse_lookup,   reverse_emitter,
                                          reverse_material, reverse_material_end};
    struct reverse r;
    r.tracer = tracer;
    r.sink = sink;
    r.any = false;
    pieces(&reverse, &r, tracer, walk, adjoint);
}

/* ---- Forward --------------------------------------------------------------------- */

struct forward {
    const struct imp_tracer *tracer;
    imp_dot_fn *dot;
    const void *x_dot;
    imp_spec L_dot;
};

static void forward_lookup(void *taker, const struct imp_input *const *input,
                           const struct imp_texcoord *at, imp_spec bar)
{
    struct forward *f = taker;
    imp_spec v_dot;
    imp__inputs_tangent(input, 1, at, f->dot, f->x_dot, &v_dot);
    f->L_dot += v_dot * bar;
}

static void forward_number(void *taker, const struct imp_input *input, imp_spec bar)
{
    const struct imp_texcoord nowhere = {.uv = {0}};
    forward_lookup(taker, &input, &nowhere, bar);
}

static void forward_texels(void *taker, const struct imp_reduction *all, int slot,
                           const uint32_t *words, imp_spec bar)
{
    struct forward *f = taker;
    const int param = all->slot[slot]->texture->param;
    const size_t n = all->texel_channels[slot];
    struct imp_reduced_texels t;
    imp_spec v_dot = {0};
    double w[4];
    memcpy(&t, words, sizeof t);
    imp__reduced_weights(&t, w);
    for (int k = 0; k < 4; k++) {
        imp_spec d = imp__spec(f->dot(f->x_dot, param, t.element[k]));
        for (size_t c = 1; c < n; c++) d[c] = f->dot(f->x_dot, param, t.element[k] + c);
        v_dot += d * w[k];
    }
    f->L_dot += v_dot * bar;
}

static void forward_emitter(void *taker, int emitter, struct imp_emission *x,
                            struct imp_texcoord *at, imp_spec bar)
{
    struct forward *f = taker;
    f->L_dot += imp__emitter_tangent(f->tracer, emitter, *x, *at, f->dot, f->x_dot) * bar;
}

static void forward_material(void *taker, const struct imp_reduced_at_hand *m,
                             const imp_spec *d, imp_spec bar)
{
    struct forward *f = taker;
    const struct imp_bsdf *b = m->bsdf;
    const struct imp_texcoord at = imp__reduced_material_at(f->tracer->scene, m);
    imp_spec in_dot[IMP_INPUTS_MAX], v_dot = {0};
    imp__inputs_tangent(b->input, b->n_in, &at, f->dot, f->x_dot, in_dot);
    for (int j = 0; j < b->n_in; j++) v_dot += d[j] * in_dot[j];
    f->L_dot += v_dot * bar;
}

static void forward_material_end(void *taker, const struct imp_reduced_at_hand *m)
{
    (void)taker, (void)m; /* along a direction, each value is by itself */
}

imp_spec imp__reduced_tangent(const struct imp_tracer *tracer,
                              const struct imp_walk *walk, imp_dot_fn *dot,
                              const void *x_dot)
{
    static const struct taking forward = {forward_number,   forward_texels,
                                          forward_lookup,   forward_emitter,
                                          forward_material, forward_material_end};
    struct forward f = {tracer, dot, x_dot, {0}};
    pieces(&forward, &f, tracer, walk, imp__spec(1));
    return f.L_dot;
}
