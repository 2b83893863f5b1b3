/* SPDX-License-Identifier: Apache-2.0
 *
 * Kinds by name: the tables of the library, and copies of those that a host registered, in
 * a list of the context, so that a scene can be built from them as long as the context
 * lives. */
#include "registry.h"
#include "base/nearest.h"
#include <stdio.h>
#include <string.h>

const void *imp__kind_built_in(enum imp_concept concept, size_t i)
{
    switch (concept) {
    case IMP_CONCEPT_BSDF: return imp__bsdf_kinds[i];
    case IMP_CONCEPT_TEXTURE: return imp__texture_kinds[i];
    case IMP_CONCEPT_SHAPE: return imp__shape_kinds[i];
    case IMP_CONCEPT_EMITTER: return imp__emitter_kinds[i];
    case IMP_CONCEPT_SENSOR: return imp__sensor_kinds[i];
    case IMP_CONCEPT_VOLUME: return imp__volume_kinds[i];
    case IMP_CONCEPT_PHASE: return imp__phase_kinds[i];
    case IMP_CONCEPT_MEDIUM: return imp__medium_kinds[i];
    case IMP_CONCEPT_FILTER: break;
    }
    return imp__filter_kinds[i];
}

const void *imp__kind_at(const imp_context *ctx, enum imp_concept concept, size_t i)
{
    size_t n = 0;
    while (imp__kind_built_in(concept, n)) n++;
    if (i < n) return imp__kind_built_in(concept, i);
    for (const struct imp_registered *r = ctx->kinds; r; r = r->next)
        if (r->concept == (int)concept && n++ == i) return r->ops;
    return NULL;
}

const char *imp__kind_tag(const imp_context *ctx, const char *type,
                          struct imp_nearest *near)
{
    static const char *const tags[] = {
        [IMP_CONCEPT_BSDF] = "bsdf",     [IMP_CONCEPT_TEXTURE] = "texture",
        [IMP_CONCEPT_SHAPE] = "shape",   [IMP_CONCEPT_EMITTER] = "emitter",
        [IMP_CONCEPT_SENSOR] = "sensor", [IMP_CONCEPT_FILTER] = "rfilter"};
    for (size_t c = 0; c < imp_count(tags); c++) {
        const void *at;
        for (size_t i = 0; (at = imp__kind_at(ctx, (enum imp_concept)c, i)); i++) {
            const char *name = imp__kind_head(at).name;
            if (strcmp(name, type) == 0) return tags[c];
            if (near) imp__nearest_try(near, name);
        }
    }
    return NULL;
}

enum imp_status imp__kind_choose(imp_context *ctx, const struct imp_node *node,
                                 const void *(*at)(const void *payload, size_t i),
                                 const void *payload, const void **ops)
{
    const void *kind;
    const char *before = "";
    char list[1024] = "";
    struct imp_nearest near = imp__nearest(node->type);
    for (size_t i = 0; (kind = at(payload, i)); i++) {
        const char *name = imp__kind_head(kind).name;
        if (strcmp(name, node->type) == 0) {
            *ops = kind;
            return IMP_OK;
        }
        imp__nearest_try(&near, name);
        const size_t n = strlen(list);
        if (strcmp(name, before) != 0) /* two kinds of one name stand together */
            snprintf(list + n, sizeof list - n, "%s%s", i ? ", " : "", name);
        before = name;
    }
    return imp__node_error(ctx, node, IMP_E_UNSUPPORTED,
                           "this version has no such %s; it has %s%s%s%s", node->tag,
                           list, near.best ? "; did you mean '" : "",
                           near.best ? near.best : "", near.best ? "'?" : "");
}

struct concept {
    const imp_context *ctx;
    enum imp_concept concept;
};
static const void *concept_at(const void *payload, size_t i)
{
    const struct concept *c = payload;
    return imp__kind_at(c->ctx, c->concept, i);
}

enum imp_status imp__kind_find(imp_context *ctx, enum imp_concept concept,
                               const struct imp_node *node, const void **ops)
{
    const struct concept c = {ctx, concept};
    return imp__kind_choose(ctx, node, concept_at, &c, ops);
}
