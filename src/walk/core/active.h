/* SPDX-License-Identifier: Apache-2.0
 *
 * Which numbers a derivative is wanted for, prepared once a job. */
#ifndef IMP_WALK_ACTIVE_H
#define IMP_WALK_ACTIVE_H

#include "base/compiler.h"
#include "scene/scene.h"

enum { IMP_BY_EXTINCTION = 2 };

/* How the numbers v of a parameter follow x, where they are not x[base + e]
 * (inverse/problem/tied_parameters.c). */
struct imp_tied {
    const struct imp_param *param; /* NULL: they are */
    const double *factor;          /* [count]: v[e] = factor[e] x[base], or with log
                                      factor[e] exp(x[base]); NULL: a number each */
    bool log;                      /* v[e] = exp(x[base + e]) */
    const uint8_t *held; /* [count]: v[e] stays, whatever x[base + e]; NULL: none does */
};

struct imp_active {
    size_t n;              /* numbers in x */
    int64_t *base;         /* [n_params] index in x of a parameter's first number, or -1;
                         parameters with the same numbers share it */
    struct imp_tied *tied; /* [n_params]; NULL: none of them is */
    uint8_t *bsdf; /* [n_bsdfs] does it depend on an active value; IMP_BY_EXTINCTION:
                         by extinctions alone, which probes differentiate */
    /* [n_bsdfs] bit j: its input j does, children's included; of clear glass also the index, which does
     * not, where something moves: lobes are then drawn for that. */
    uint64_t *inputs;
    uint8_t *emitter; /* [n_emitters] */
    uint8_t *body;    /* [n_bodies]; NULL: none of them */
    uint8_t *medium;  /* [n_media] does its extinction; NULL: none of them */
    uint64_t
        *unseen; /* [n_media] mask of inputs that are not looked up for derivatives with
                         respect to its extinction; NULL with medium */
};
/* Where in x number e of an active parameter is. */
static inline size_t imp__active_at(const struct imp_active *a, int param, size_t e)
{
    const size_t base = (size_t)a->base[param];
    return imp_unlikely(a->tied && a->tied[param].factor) ? base : base + e;
}
double imp__tied_slope(const struct imp_tied *tied, size_t e);
/* d number e / d x of it. */
static inline double imp__active_slope(const struct imp_active *a, int param, size_t e)
{
    return imp_likely(!a->tied) ? 1 : imp__tied_slope(&a->tied[param], e);
}
/* Does it depend on a parameter that is chosen? `chosen` [n_params]. */
bool imp__input_depends(const struct imp_input *input, const uint8_t *chosen);
/* The inputs of a material that do: bit j is input j. */
uint64_t imp__inputs_depend(const struct imp_bsdf *b, const uint8_t *chosen);
enum imp_status imp__active_create(const struct imp_scene *scene, const uint8_t *chosen,
                                   struct imp_active *out);
void imp__active_destroy(imp_context *ctx, struct imp_active *active);

#endif
