/* SPDX-License-Identifier: Apache-2.0
 *
 * Reduced walks while they are made. Whatever does not fit sets `failed`. */
#ifndef IMP_WALK_REDUCE_H
#define IMP_WALK_REDUCE_H

#include "reduced.h"

void imp__reduced_op(struct imp_reduced *r, enum imp_op_kind kind, int index);
void imp__reduced_words(struct imp_reduced *r, const void *data, size_t bytes);
/* A term with its number c; lit: the direction of the light, NULL: none. `data`: between these.
 */
void imp__reduced_term(struct imp_reduced *r, enum imp_op_kind kind, int index,
                       imp_spec c, const float lit[3], const void *data, size_t bytes);
/* An array of what it holds alone; one that cannot be made stays as it is. */
void *imp__reduced_trimmed(imp_context *ctx, void *array, size_t n, size_t size);

#endif
