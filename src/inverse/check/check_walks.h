/* SPDX-License-Identifier: Apache-2.0
 *
 * Walks that are kept for checks, with their gradients: vertices, directions, densities
 * and decisions are frozen, so nothing here has noise. Colours are folded to one number
 * with weights that differ, so that a derivative in the wrong lane shows. */
#ifndef IMP_INVERSE_CHECK_WALKS_H
#define IMP_INVERSE_CHECK_WALKS_H

#include "check.h"

#define IMP_KEPT_TRIES   50     /* walks traced for one that is kept */
#define IMP_KEPT_NOTHING 1e-200 /* below it products lose digits to underflow */
#define IMP_EXACT_LIMIT  1e-12

struct imp__kept_entry {
    size_t i; /* in x */
    double g;
};

struct imp__kept_walk {
    struct imp_walk walk;
    struct imp__kept_entry *gradient; /* of the folded value; may name a number twice */
    size_t n;
    double L;
};

struct imp__kept {
    struct imp__check *check;
    struct imp_arena arena;
    struct imp__kept_walk *walks;
    size_t n;
    double *value[3]; /* [n] frozen values at up to three places */
};

struct imp__kept_list {
    struct imp_sink sink; /* first */
    const struct imp_active *active;
    imp_context *ctx;
    int lanes;
    struct imp__kept_entry *at;
    size_t n, cap;
    bool failed;
};

double imp__kept_fold(const struct imp__check *c, imp_spec L);
imp_spec imp__kept_fold_bar(const struct imp__check *c);

/* The sink behind a list; `failed`: out of memory. */
void imp__kept_add(struct imp_sink *sink, int param, size_t element, int channels,
                   const imp_spec *bar);

/* Walks with light or a derivative, at most options.paths of them. *k has its check and
 * its arena; to be destroyed also after a failure. */
enum imp_status imp__kept_create(struct imp__kept *k);
void imp__kept_destroy(struct imp__kept *k);

/* check_identities.c: dot and euler rows. */
enum imp_status imp__check_identities(struct imp__kept *k);

#endif
