/* SPDX-License-Identifier: Apache-2.0
 *
 * Inside of manifests. */
#ifndef IMP_FILM_MANIFEST_FILE_H
#define IMP_FILM_MANIFEST_FILE_H

#include "parts.h"
#include "parts_file.h"

enum imp__item_kind { IMP_ITEM_INPUT, IMP_ITEM_RESULT, IMP_ITEM_OUTPUT };

/* Something that has a hash. */
struct imp__item {
    uint32_t kind;
    bool met; /* when verifying: it was there */
    uint64_t size, hash;
    char *name;
};

struct imp_manifest {
    imp_context *ctx;
    bool making, whole; /* whole: without sums */
    char machine[256];
    char *command;
    size_t n_items, cap_items;
    struct imp__item *items;
    struct imp_bytes bytes; /* the messages; when reading, the file */
    size_t limit;           /* of them; beyond it, none are kept */
    size_t n_messages, cap_messages, next;
    struct imp__kept_message *messages;
    uint64_t n_sums, n_verified; /* chunks of sums */
    unsigned n_calls;            /* sums that have been kept */
    double fraction;
    uint64_t seed;
    bool no_memory;
    char refuted[512];
};

/* With the name copied; false: no memory. */
bool imp__manifest_add(imp_manifest *m, enum imp__item_kind kind, const char *name,
                       uint64_t size, uint64_t hash);
/* Take what a file holds, whose bytes are in m->bytes. */
enum imp_status imp__manifest_take(imp_manifest *m, const char *path);
/* What a file of it holds; false: no memory. */
bool imp__manifest_bytes(const imp_manifest *m, struct imp_bytes *out);

#endif
