/* SPDX-License-Identifier: Apache-2.0
 *
 * Names that somebody may have meant: suggestions in messages. */
#ifndef IMP_BASE_NEAREST_H
#define IMP_BASE_NEAREST_H

#include <stddef.h>

/* Levenshtein's distance; SIZE_MAX for long names, where it is not computed. */
size_t imp__edit_distance(const char *a, const char *b);

/* The nearest of the candidates shown to imp__nearest_try, if it is near. */
struct imp_nearest {
    const char *given, *best;
    size_t distance;
};
struct imp_nearest imp__nearest(const char *given);
void imp__nearest_try(struct imp_nearest *n, const char *candidate);

#endif
