/* SPDX-License-Identifier: Apache-2.0
 *
 * What ops of a reduced walk say, and what is kept between its value and its sweep. */
#ifndef IMP_WALK_REDUCED_READ_H
#define IMP_WALK_REDUCED_READ_H

#include "reduced.h"
#include <stddef.h>
#include <string.h>

/* The same for a material that is at hand. */
struct imp_reduced_at_hand {
    const struct imp_bsdf *bsdf;
    const uint32_t *words; /* its struct imp_reduced_material: where it is */
    imp_v3 wo;
    imp_spec *in; /* [bsdf->n_in] */
    bool plain;   /* all inputs are numbers */
};
struct imp_reduced_seen {
    imp_spec value;
    struct imp_reduced_at_hand *material; /* NULL: a lookup */
    imp_spec
        *d; /* [n_in] its derivatives, where they were needed for the value; or NULL */
};

/* ---- Reading --------------------------------------------------------------------- */

/* The last number of a term, whose words end here. */
static inline imp_spec imp__reduced_number(struct imp_op op, const uint32_t *end)
{
    double c[3];
    if (imp_likely(!op.coloured)) {
        memcpy(c, end - IMP_OP_NUMBER, sizeof *c);
        return imp__spec(c[0]);
    }
    memcpy(c, end - 3 * IMP_OP_NUMBER, sizeof c);
    return (imp_spec){c[0], c[1], c[2], 0};
}

static inline struct imp_texcoord imp__reduced_texcoord(const struct imp_scene *scene,
                                                        const struct imp_reduced_place *p)
{
    return (struct imp_texcoord){.uv = {p->uv[0], p->uv[1]},
                                 .p = imp__decided_v3(p->p),
                                 .shape = scene->shapes[p->shape]};
}

static inline struct imp_texcoord imp__reduced_lookup_at(const struct imp_scene *scene,
                                                         const uint32_t *words)
{
    struct imp_reduced_place place;
    memcpy(&place, words, sizeof place);
    return imp__reduced_texcoord(scene, &place);
}

/* Where the material at hand is. */
static inline struct imp_texcoord
imp__reduced_material_at(const struct imp_scene *scene,
                         const struct imp_reduced_at_hand *m)
{
    return imp__reduced_lookup_at(
        scene, m->words + offsetof(struct imp_reduced_material, at) / sizeof *m->words);
}

/* The weights of four texels. */
static inline void imp__reduced_weights(const struct imp_reduced_texels *t, double w[4])
{
    w[0] = (1 - t->a) * (1 - t->b);
    w[1] = t->a * (1 - t->b);
    w[2] = (1 - t->a) * t->b;
    w[3] = t->a * t->b;
}

static inline struct imp_emission imp__reduced_emission_of(const uint32_t *words,
                                                           imp_v3 *p)
{
    struct imp_reduced_emission e;
    memcpy(&e, words, sizeof e);
    *p = imp__decided_v3(e.p);
    return (struct imp_emission){
        {e.uv[0], e.uv[1]}, e.dist, e.cos_light, imp__decided_v3(e.d)};
}

static inline struct imp_dirs imp__reduced_on_dirs(const struct imp_reduced_at_hand *m,
                                                   const uint32_t *words)
{
    struct imp_reduced_on on;
    memcpy(&on, words, sizeof on);
    return (struct imp_dirs){m->wo, imp__decided_v3(on.wi), on.lobe, 0};
}
/* Towards the light of a term that is lit. */
static inline struct imp_dirs imp__reduced_lit_dirs(const struct imp_reduced_at_hand *m,
                                                    const uint32_t *words)
{
    float wi[3];
    memcpy(wi, words, sizeof wi);
    return (struct imp_dirs){m->wo, imp__decided_v3(wi), IMP_SMOOTH, 0};
}

/* A term without the material at hand: c, times what it is a term of. kind: the op's, constant
 * where this is called; words, end: the op's; m: the material at hand. */
static inline __attribute__((always_inline)) imp_spec
imp__reduced_term_value(const struct imp_reduction *all, enum imp_op_kind kind,
                        struct imp_op op, const uint32_t *words, const uint32_t *end,
                        const struct imp_reduced_at_hand *m)
{
    const imp_spec c = imp__reduced_number(op, end);
    switch (kind) {
    case IMP_OP_INPUT: return c * all->slot[op.index]->value;
    case IMP_OP_EMITTER: {
        imp_v3 p;
        const struct imp_emission x =
            imp__reduced_emission_of(words + (op.lit ? IMP_OP_TOWARDS : 0), &p);
        return c * imp__emitter_radiance(all->scene, (int)op.index, &x, p, NULL);
    }
    case IMP_OP_GLOW: {
        imp_spec glow;
        m->bsdf->ops->emit(m->bsdf, m->in, &m->wo, &glow);
        return c * glow;
    }
    default: return c;
    }
}

#endif
