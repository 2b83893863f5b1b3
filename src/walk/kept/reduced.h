/* SPDX-License-Identifier: Apache-2.0
 *
 * Recorded walks written as sums of products. Most values are linear in what may still change:
 * a reflectance, the radiance of a lamp, the scale of a table. All else of a walk is one
 * number c in front of each term,
 *
 *     L = sum over terms t of  c_t v_t  prod over factors before it of  v_f
 *
 * with v the inputs that may change. What no input that may change enters is part of c:
 * vertices of such materials vanish. Materials that are not linear in an input that may
 * change (a roughness) stay as they are, with directions and inputs.
 *
 * Where vertices lie is in the record alone: what moves with a shape is not evaluated here.
 *
 * Which kinds are linear is found by trying (kind_trials.h). Numbers c are doubles, so that L
 * and derivatives differ from those of the walk's vertices by rounding alone. */
#ifndef IMP_WALK_REDUCED_H
#define IMP_WALK_REDUCED_H

#include "record.h"

/* ---- What may change ------------------------------------------------------------- */

enum imp_reduction_class {
    IMP_REDUCES_CONSTANT, /* no input may change */
    IMP_REDUCES_LINEAR,
    IMP_REDUCES_NOT /* free_bsdf marks what it is of first degree in (kind_trials.h) */
};

/* The reduction for a scene and the parameters that may change. */
struct imp_reduction {
    imp_context *ctx;
    const struct imp_scene *scene;
    int channels;
    uint8_t *bsdf, *emitter; /* [n_bsdfs], [n_emitters] enum imp_reduction_class */
    uint8_t *free_bsdf, *free_emitter; /* [n][IMP_INPUTS_MAX] inputs that may change */
    int *bsdf_slot, *emitter_slot;     /* [n_bsdfs], [n_emitters] of the first input */
    int n_slots;
    const struct imp_input **slot; /* [n_slots] */
    int *inner;                    /* [n_slots] slot of its texture's first input */
    uint8_t *free_slot;            /* [n_slots] it may change */
    const float **texels;          /* [n_slots] of a bitmap; NULL: it is none */
    uint8_t *texel_channels;       /* [n_slots] 1 or 3 */
    const struct imp_bsdf **owner; /* [n_slots] NULL: an emitter's */
};

/* free [n_params]. *out is NULL where walks are not reduced: they carry wavelengths, media
 * bend rays, or a picture asks for the first hit. */
enum imp_status imp__reduction_create(const struct imp_scene *scene,
                                      const struct imp_walk_integrator *integrator,
                                      const uint8_t *free, struct imp_reduction **out);
void imp__reduction_destroy(struct imp_reduction *r);

/* ---- Walks of a tile ------------------------------------------------------------- */

enum imp_op_kind {
    /* Terms. `index`: a slot, an emitter. */
    IMP_OP_CONSTANT, /* c */
    IMP_OP_INPUT,    /* c times a number */
    IMP_OP_EMITTER,  /* c times the radiance of an emitter */
    IMP_OP_GLOW,     /* c times what the material at hand emits */
    /* Factors of all that follows. */
    IMP_OP_FACTOR,  /* a number */
    IMP_OP_TEXELS,  /* up to four texels of an input that is a bitmap */
    IMP_OP_LOOKUP,  /* an input with another texture, at a place */
    IMP_OP_ON,      /* the material at hand, for the direction of the continuation */
    IMP_OP_MATERIAL /* which is at hand from here on */
};
static inline bool imp__op_is_term(enum imp_op_kind kind) { return kind < IMP_OP_FACTOR; }

/* lit: a term times the material at hand, towards a light. coloured: c has three numbers. */
struct imp_op {
    uint32_t kind : 4, coloured : 1, lit : 1, index : 26;
};
#define IMP_OP_INDICES (1 << 26)
enum {
    IMP_OP_NUMBER = sizeof(double) / sizeof(uint32_t), /* words of a number */
    IMP_OP_TOWARDS = 3                                 /* of a direction */
};
#define IMP_REDUCED_MOST 128 /* ops of a walk; one of more stays as it is */

struct imp_reduced_place {
    float uv[2], p[3];
    int32_t shape;
};
struct imp_reduced_texels {
    uint32_t element[4];
    double a, b; /* as of struct imp__cell; one texel: a = b = 0, and all are this one */
};
struct imp_reduced_material {
    struct imp_reduced_place at;
    float wo[3];
};
struct imp_reduced_emission {
    float uv[2], dist, cos_light, d[3], p[3];
};
struct imp_reduced_on {
    float wi[3];
    int32_t lobe;
};

/* Words that belong to an op; of a term, the direction of the light is first and c is last. */
static inline size_t imp__op_words(struct imp_op op)
{
    enum { WORD = sizeof(uint32_t) };
    static const uint8_t words[16] = {
        [IMP_OP_CONSTANT] = IMP_OP_NUMBER,
        [IMP_OP_INPUT] = IMP_OP_NUMBER,
        [IMP_OP_GLOW] = IMP_OP_NUMBER,
        [IMP_OP_EMITTER] = IMP_OP_NUMBER + sizeof(struct imp_reduced_emission) / WORD,
        [IMP_OP_TEXELS] = sizeof(struct imp_reduced_texels) / WORD,
        [IMP_OP_LOOKUP] = sizeof(struct imp_reduced_place) / WORD,
        [IMP_OP_ON] = sizeof(struct imp_reduced_on) / WORD,
        [IMP_OP_MATERIAL] = sizeof(struct imp_reduced_material) / WORD};
    return words[op.kind] + (op.coloured ? 2u * IMP_OP_NUMBER : 0) +
           (op.lit ? IMP_OP_TOWARDS : 0);
}

/* Where a walk begins in the arrays; it ends where the next one does. */
struct imp_reduced_walk {
    uint32_t op : 31, whole : 1; /* whole: it is reduced */
    uint32_t word;
};
struct imp_reduced {
    const struct imp_reduction *of; /* NULL: there is none */
    struct imp_reduced_walk *walks; /* [n_walks + 1] */
    struct imp_op *ops;
    uint32_t *words; /* what belongs to ops, in their order */
    size_t n_walks, n_ops, n_words, cap_walks, cap_ops, cap_words;
    bool failed; /* no memory, or too many */
};
/* All walks of a record. No memory, or too many: `of` is NULL. */
void imp__reduced_make(const struct imp_reduction *of, const struct imp_record *record,
                       struct imp_reduced *out);
void imp__reduced_free(struct imp_reduced *r);
size_t imp__reduced_bytes(const struct imp_reduced *r);

/* ---- One walk -------------------------------------------------------------------- */

/* What a factor was found to be when it was evaluated, to be read by the sweep: a lookup,
 * or a material for one direction. */
struct imp_reduced_seen;
/* imp_walk.reduced */
struct imp_reduced_of {
    struct imp_reduced_ops ops;
    const struct imp_reduced *all;
    uint32_t op, n_ops, word;
    struct imp_reduced_seen *seen; /* [as many as need it], in the order of ops */
};

/* L of walk i at the scene's present parameters, as imp__record_walk has it; false: this
 * one is not reduced. With a tracer that wants derivatives it can be swept. */
bool imp__reduced_walk(const struct imp_reduced *r, const struct imp_record *record,
                       size_t i, const struct imp_tracer *tracer, struct imp_arena *arena,
                       struct imp_walk *walk);
void imp__reduced_sweep(const struct imp_tracer *tracer, const struct imp_walk *walk,
                        imp_spec adjoint, struct imp_sink *sink);
imp_spec imp__reduced_tangent(const struct imp_tracer *tracer,
                              const struct imp_walk *walk, imp_dot_fn *dot,
                              const void *x_dot);

#endif
