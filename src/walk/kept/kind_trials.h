/* SPDX-License-Identifier: Apache-2.0
 *
 * Properties of kinds that they do not declare are found by trying: inputs inside their
 * bounds, directions and emissions at random. */
#ifndef IMP_WALK_TRIAL_H
#define IMP_WALK_TRIAL_H

#include "kind/build.h"

#define IMP_TRIALS 24

/* A value inside the bounds of an input; NULL: of none that is declared. */
imp_spec imp__trial_input(const struct imp_input_desc *d, uint64_t k);
/* Declaration of input j of b, its children's included; NULL: there is none. */
const struct imp_input_desc *imp__trial_desc(const struct imp_bsdf *b, int j);
/* Does it derive something from its inputs once for all directions? Then nothing is known
 * of it by trying. */
bool imp__trial_derives(const struct imp_bsdf *b);
/* Directions of trial k, for smooth lobes. */
struct imp_dirs imp__trial_dirs(uint64_t k);
/* Delta lobes that are tried. */
static inline int imp__trial_lobes(const struct imp_bsdf *b)
{
    return b->flags & IMP_BSDF_DELTA ? imp_max(b->n_lobes, 2) : 0;
}

/* Are its value and its own emission linear functions, without a constant, of the inputs
 * that are free [n_in], whatever the others are? */
bool imp__trial_bsdf_linear(const struct imp_bsdf *b, const uint8_t *free, int channels);
/* Marks its reflectances [n_in], if its value is f = sum in_j df/d in_j over these, whatever
 * the others are; else none. */
void imp__trial_first_degree(const struct imp_bsdf *b, int channels, uint8_t *of);
/* Is its radiance? */
bool imp__trial_emitter_linear(const struct imp_emitter *e, const uint8_t *free,
                               int channels);

#endif
