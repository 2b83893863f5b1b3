/* SPDX-License-Identifier: Apache-2.0
 *
 * Checkpoints: the state of a search as a text file, numbers as the 64 bits of a double
 * in hexadecimal, so that a continued fit has the bits of one that was never stopped. */
#ifndef IMP_SEARCH_CHECKPOINT_H
#define IMP_SEARCH_CHECKPOINT_H

#include "optimize.h"

/* Hashes of the problem that a search belongs to; the first that differs is named when a
 * checkpoint is refused. */
struct imp__fingerprint {
    uint64_t parameters, scene, targets, options;
};

/* The file appears whole or not at all. */
enum imp_status imp__checkpoint_write(imp_context *ctx, const char *path,
                                      const struct imp__fingerprint *of,
                                      const struct imp__search *search);

/* Read into a search just created for the same problem (and unchanged on failure).
 * *found false: there is no such file. IMP_E_ARG: it belongs to another problem. */
enum imp_status imp__checkpoint_read(imp_context *ctx, const char *path,
                                     const struct imp__fingerprint *of,
                                     const struct imp__goal *goal,
                                     struct imp__search *search, bool *found);

#endif
