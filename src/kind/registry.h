/* SPDX-License-Identifier: Apache-2.0
 *
 * All kinds of a concept: the built-in ones, then those that a host registered in a
 * context (imp_register_kind, kinds.h). */
#ifndef IMP_KIND_REGISTRY_H
#define IMP_KIND_REGISTRY_H

#include "base/nearest.h"
#include "build.h"
#include <string.h>

/* What all tables begin with. */
struct imp_kind_head {
    size_t size;
    const char *name;
    size_t object_size;
};
static inline struct imp_kind_head imp__kind_head(const void *ops)
{
    struct imp_kind_head h;
    memcpy(&h, ops, sizeof h);
    return h;
}

/* Table i of those that the library has; NULL after the last. */
const void *imp__kind_built_in(enum imp_concept concept, size_t i);
/* Table i of a concept (struct imp_bsdf_ops, ...); NULL after the last. */
const void *imp__kind_at(const imp_context *ctx, enum imp_concept concept, size_t i);
/* The tag of the first concept that has a kind of this type ("bsdf", ..., "rfilter");
 * NULL: none has. `near` (may be NULL) is shown every type. */
const char *imp__kind_tag(const imp_context *ctx, const char *type,
                          struct imp_nearest *near);
/* The first kind of the node's type among those that `at` gives (NULL after the last; all
 * tables begin with size, name and object_size), or IMP_E_UNSUPPORTED with their list. */
enum imp_status imp__kind_choose(imp_context *ctx, const struct imp_node *node,
                                 const void *(*at)(const void *payload, size_t i),
                                 const void *payload, const void **ops);
/* Among all of a concept. */
enum imp_status imp__kind_find(imp_context *ctx, enum imp_concept concept,
                               const struct imp_node *node, const void **ops);

#endif
