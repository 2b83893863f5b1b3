/* SPDX-License-Identifier: Apache-2.0
 *
 * The reconstruction filters: one line a kind; and making one from its node. */
#include "filter.h"
#include "kind/registry.h"

#define FILTERS(X)                                                                       \
    X(imp__box)                                                                          \
    X(imp__tent)                                                                         \
    X(imp__gaussian)                                                                     \
    X(imp__mitchell)                                                                     \
    X(imp__catmullrom)                                                                   \
    X(imp__lanczos)

#define DECLARE(kind) extern const struct imp_filter_ops kind;
FILTERS(DECLARE)
#define ADDRESS(kind) &kind,
const struct imp_filter_ops *const imp__filter_kinds[] = {FILTERS(ADDRESS) NULL};

enum imp_status imp__filter_size(const struct imp_build *b, const char *name,
                                 double fallback, double limit, double *out)
{
    /* Below this a sample could miss every pixel centre by rounding. */
    return imp__props_float_in(b->ctx, b->node, name, fallback,
                               (struct imp_interval){1e-3, limit, IMP_CLOSED}, out);
}

enum imp_status imp__filter_build(const struct imp_build *b, struct imp_node *node,
                                  struct imp_filter *out)
{
    enum imp_status st = IMP_OK;
    struct imp_filter f = {0};
    struct imp_build own = *b;
    const void *found;

    if (!node) {
        node = imp__node_create(b->arena, "rfilter", "gaussian", NULL, NULL,
                                b->node ? b->node->loc : (struct imp_loc){0});
        if (!node) IMP_TRY(imp__error(b->ctx, IMP_E_NOMEM, "out of memory for a filter"));
    }
    own.node = node;
    IMP_TRY(imp__kind_find(b->ctx, IMP_CONCEPT_FILTER, node, &found));
    f.ops = found;
    f.self = imp_build_alloc(b, 1, f.ops->object_size ? f.ops->object_size : 1);
    if (!f.self) IMP_TRY(imp__node_error(b->ctx, node, IMP_E_NOMEM, "out of memory"));
    IMP_TRY(f.ops->build(&own, f.self, &f));
    IMP_TRY(imp__props_finish(b->ctx, node));
    *out = f;
out:
    return st;
}
