/* SPDX-License-Identifier: Apache-2.0
 *
 * Hash table from (owner, name) to a value: ids of a scene, names inside an object. Names
 * must outlive the table. */
#ifndef IMP_FORMAT_NAMES_H
#define IMP_FORMAT_NAMES_H

#include "base/props.h"

struct imp_names {
    imp_context *ctx;
    size_t n, capacity; /* capacity 0 or a power of two */
    struct imp_name {
        const void *owner;
        const char *name; /* NULL: free */
        void *value;
        struct imp_loc loc;
    } * slots;
};

/* The entry, or NULL. */
struct imp_name *imp__names_find(const struct imp_names *t, const void *owner,
                                 const char *name);
/* Add a name that is not there; NULL if out of memory. Valid until the next addition. */
struct imp_name *imp__names_add(struct imp_names *t, const void *owner, const char *name,
                                void *value, struct imp_loc loc);
void imp__names_free(struct imp_names *t);

#endif
