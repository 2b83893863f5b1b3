/* SPDX-License-Identifier: Apache-2.0
 *
 * The value of a reduced walk at the scene's present parameters: summed from the first term
 * to the last, with P the product of the factors before each. */
#include "reduced_read.h"

static inline imp_spec texels_value(const struct imp_reduction *all, struct imp_op op,
                                    const uint32_t *words)
{
    const float *data = all->texels[op.index];
    struct imp_reduced_texels t;
    imp_spec sum = {0};
    double w[4];
    memcpy(&t, words, sizeof t);
    imp__reduced_weights(&t, w);
    for (int k = 0; k < 4; k++) {
        imp_float4 texel; /* behind the last one there is one number more */
        if (all->texel_channels[op.index] == 1) {
            sum += imp__spec(w[k] * data[t.element[k]]);
            continue;
        }
        memcpy(&texel, data + t.element[k], sizeof texel);
        sum += imp__widen(texel) * w[k];
    }
    return sum;
}

static void material_look(const struct imp_scene *scene, struct imp_op op,
                          const uint32_t *words, struct imp_reduced_at_hand *m)
{
    float wo[3];
    memcpy(wo, words + offsetof(struct imp_reduced_material, wo) / sizeof *words,
           sizeof wo);
    m->bsdf = scene->bsdfs[op.index];
    m->words = words;
    m->wo = imp__decided_v3(wo);
    const struct imp_input *const *input = m->bsdf->input;
    const int n = m->bsdf->n_in;
    bool plain = true;
    for (int j = 0; j < n; j++) {
        m->in[j] = input[j]->value;
        plain &= input[j]->plain;
    }
    m->plain = plain;
    if (imp_likely(plain)) return;
    const struct imp_texcoord at = imp__reduced_material_at(scene, m);
    imp__inputs_eval(input, n, &at, m->in);
}

/* ---- Sums ------------------------------------------------------------------------ */

/* A material in the arena, where the sweep finds it again; NULL: no memory. */
static struct imp_reduced_at_hand *
material_take(const struct imp_scene *scene, struct imp_arena *arena, struct imp_op op)
{
    const size_t n = (size_t)scene->bsdfs[op.index]->n_in;
    struct imp_reduced_at_hand *m = imp__arena_take(arena, 1, sizeof *m);
    if (m) m->in = imp__arena_take(arena, n + 1, sizeof *m->in);
    return m && m->in ? m : NULL;
}

/* The value of the material for directions; with an arena, derivatives will be wanted,
 * and where they give the value they are made first. False: no memory. */
static inline bool material_eval(const struct imp_reduction *all, struct imp_arena *arena,
                                 const struct imp_reduced_at_hand *m,
                                 const struct imp_dirs *dirs, imp_spec *f, imp_spec **d)
{
    const struct imp_bsdf *b = m->bsdf;
    const uint8_t *of = all->free_bsdf + (size_t)b->index * IMP_INPUTS_MAX;
    int n = 0;
    for (int j = 0; arena && j < b->n_in; j++) n += of[j];
    if (n == 0) {
        b->ops->eval(b, m->in, dirs, f);
        return true;
    }
    *d = imp__arena_take(arena, (size_t)b->n_in, sizeof **d);
    if (!*d) return false;
    b->ops->eval_d(b, m->in, dirs, *d);
    *f = (imp_spec){0};
    for (int j = 0; j < b->n_in; j++)
        if (of[j]) *f += m->in[j] * (*d)[j];
    return true;
}

/* What the sweep wants to find again, in their order. */
static inline bool seen_add(struct imp_arena *arena, struct imp_reduced_of *of, size_t *n,
                            imp_spec value, struct imp_reduced_at_hand *material,
                            imp_spec *d)
{
    if (!of) return true;
    if (*n == 0) of->seen = imp__arena_take(arena, of->n_ops, sizeof *of->seen);
    if (!of->seen) return false;
    of->seen[(*n)++] = (struct imp_reduced_seen){value, material, d};
    return true;
}

/* The sum; of NULL: nothing will be swept. False: no memory. */
static inline __attribute__((always_inline)) bool
walk_sum(const struct imp_reduced *r, const struct imp_reduced_walk *begin,
         struct imp_arena *arena, struct imp_reduced_of *of, imp_spec *sum)
{
    const struct imp_reduction *all = r->of;
    const struct imp_scene *scene = all->scene;
    struct imp_arena *derivatives = of ? arena : NULL;
    const struct imp_op *op = r->ops + begin->op, *end = r->ops + begin[1].op;
    const uint32_t *words = r->words + begin->word;
    imp_spec P = imp__spec(1), L = {0}, in[IMP_INPUTS_MAX];
    struct imp_reduced_at_hand own, *m = &own; /* set by the first material */
    size_t n = 0;
    own.in = in;
#define TERM(kind)                                                                       \
    term = imp__reduced_term_value(all, kind, o, at, words, m);                          \
    break
    for (; op < end; op++) {
        const struct imp_op o = *op;
        const uint32_t *at = words;
        imp_spec f, term, *d = NULL;
        words += imp__op_words(o);
        switch ((enum imp_op_kind)o.kind) {
        case IMP_OP_FACTOR: P *= all->slot[o.index]->value; continue;
        case IMP_OP_TEXELS:
            f = texels_value(all, o, at);
            if (!seen_add(arena, of, &n, f, NULL, NULL)) return false;
            P *= f;
            continue;
        case IMP_OP_LOOKUP: {
            const struct imp_texcoord place = imp__reduced_lookup_at(scene, at);
            imp__inputs_eval(&all->slot[o.index], 1, &place, &f);
            if (!seen_add(arena, of, &n, f, NULL, NULL)) return false;
            P *= f;
            continue;
        }
        case IMP_OP_MATERIAL:
            m = of ? material_take(scene, arena, o) : &own;
            if (!m || !seen_add(arena, of, &n, imp__spec(0), m, NULL)) return false;
            material_look(scene, o, at, m);
            continue;
        case IMP_OP_ON: {
            const struct imp_dirs dirs = imp__reduced_on_dirs(m, at);
            if (!material_eval(all, derivatives, m, &dirs, &f, &d) ||
                !seen_add(arena, of, &n, f, m, d))
                return false;
            P *= f;
            continue;
        }
        case IMP_OP_CONSTANT: TERM(IMP_OP_CONSTANT);
        case IMP_OP_INPUT: TERM(IMP_OP_INPUT);
        case IMP_OP_EMITTER: TERM(IMP_OP_EMITTER);
        case IMP_OP_GLOW: TERM(IMP_OP_GLOW);
        default: continue;
        }
        if (imp_unlikely(o.lit)) {
            const struct imp_dirs dirs = imp__reduced_lit_dirs(m, at);
            if (!material_eval(all, derivatives, m, &dirs, &f, &d) ||
                !seen_add(arena, of, &n, f, m, d))
                return false;
            term *= f;
        }
        L += P * term;
    }
#undef TERM
    *sum = L;
    return true;
}

bool imp__reduced_walk(const struct imp_reduced *r, const struct imp_record *record,
                       size_t i, const struct imp_tracer *tracer, struct imp_arena *arena,
                       struct imp_walk *walk)
{
    const struct imp_reduced_walk *begin = &r->walks[i];
    const struct imp_record_walk *k = imp__record_at(record, i);
    if (imp_unlikely(!begin->whole)) return false;
    imp__walk_clear(walk);
    walk->px = k->px;
    walk->py = k->py;
    walk->time = 0;
    walk->key = k->key;
    walk->point.points = NULL;
    walk->valid = k->valid;
    walk->absorbed = k->absorbed;
    walk->dropped = (enum imp_drop)k->dropped;
    imp_spec L;
    bool enough;
    if (tracer->value_only || !tracer->active) {
        enough = walk_sum(r, begin, arena, NULL, &L);
    } else {
        struct imp_reduced_of *of = imp__arena_take(arena, 1, sizeof *of);
        enough = of != NULL;
        if (enough) {
            *of = (struct imp_reduced_of){
                {.sweep = imp__reduced_sweep, .tangent = imp__reduced_tangent},
                r,
                begin->op,
                begin[1].op - begin->op,
                begin[1].word,
                NULL};
            walk->reduced = &of->ops;
            enough = walk_sum(r, begin, arena, of, &L);
        }
    }
    if (imp_unlikely(!enough)) walk->dropped = IMP_DROP_MEMORY;
    else imp__walk_value(tracer, walk, L);
    return true;
}
