/* SPDX-License-Identifier: Apache-2.0
 *
 * Registered kinds are kept as copies in a list of the context, so that a scene can be
 * built from them as long as the context lives. */
#include "registry.h"
#include "base/arguments.h"
#include "base/nearest.h"
#include <math.h>
#include <stddef.h>
#include <stdio.h>
#include <string.h>

/* What all tables begin with. */
struct head {
    size_t size;
    const char *name;
    size_t object_size;
};
#define BEGINS_WITH_HEAD(ops)                                                            \
    _Static_assert(offsetof(struct ops, name) == offsetof(struct head, name) &&          \
                       offsetof(struct ops, object_size) ==                              \
                           offsetof(struct head, object_size),                           \
                   #ops)
BEGINS_WITH_HEAD(imp_bsdf_ops);
BEGINS_WITH_HEAD(imp_texture_ops);
BEGINS_WITH_HEAD(imp_shape_ops);
BEGINS_WITH_HEAD(imp_emitter_ops);
BEGINS_WITH_HEAD(imp_sensor_ops);
BEGINS_WITH_HEAD(imp_filter_ops);
BEGINS_WITH_HEAD(imp_phase_ops);
BEGINS_WITH_HEAD(imp_medium_ops);

static struct head head_of(const void *ops)
{
    struct head h;
    memcpy(&h, ops, sizeof h);
    return h;
}

static const void *built_in(enum imp_concept concept, size_t i)
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
    while (built_in(concept, n)) n++;
    if (i < n) return built_in(concept, i);
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
            const char *name = head_of(at).name;
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
        const char *name = head_of(kind).name;
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

/* ---- Registering --------------------------------------------------------------- */

/* The table, completed by zeros where it is older; a newer one expects objects with
 * fields that are not there. */
static enum imp_status take(imp_context *ctx, const char *function, const void *ops,
                            void *own, size_t known)
{
    size_t size;
    memcpy(&size, ops, sizeof size);
    if (size > known)
        return imp__error(
            ctx, IMP_E_ARG,
            "%s: size %zu of ops is not the size of that struct (%zu here): "
            "it was compiled with another kinds.h",
            function, size, known);
    return imp__options_take(ctx, function, "ops", ops, own, known);
}

static bool name_fits(const char *name)
{
    if (!*name) return false;
    for (const char *c = name; *c; c++)
        if (!((*c >= 'a' && *c <= 'z') || (*c >= 'A' && *c <= 'Z') ||
              (*c >= '0' && *c <= '9') || *c == '_' || *c == '-'))
            return false;
    return true;
}

static enum imp_status inputs_check(imp_context *ctx, const char *function,
                                    const struct imp_input_desc *inputs)
{
    size_t n = 0;
    for (; inputs && inputs[n].name; n++) {
        const struct imp_input_desc *d = &inputs[n];
        if (!name_fits(d->name))
            return imp__error(ctx, IMP_E_ARG, "%s: ops: input %zu has no proper name",
                              function, n);
        if (!isfinite(d->fallback) || !(d->lo <= d->hi || (d->lo == 0 && d->hi == 0)))
            return imp__error(ctx, IMP_E_ARG,
                              "%s: ops: input '%s': fallback %g, bounds [%g, %g]",
                              function, d->name, d->fallback, d->lo, d->hi);
        bool before = false; /* under the same name */
        for (size_t k = 0; k < n; k++) before |= strcmp(inputs[k].name, d->name) == 0;
        const bool luminance = d->flags & IMP_INPUT_LUMINANCE;
        if (before && !luminance)
            return imp__error(ctx, IMP_E_ARG, "%s: ops: two inputs '%s'", function,
                              d->name);
        if (!before && luminance)
            return imp__error(ctx, IMP_E_ARG,
                              "%s: ops: no input '%s' before its luminance", function,
                              d->name);
    }
    if (n > IMP_INPUTS_MAX)
        return imp__error(ctx, IMP_E_ARG, "%s: ops: %zu inputs; at most %d", function, n,
                          IMP_INPUTS_MAX);
    return IMP_OK;
}

/* Append. Two lights may share a name, one of its own and one in a shape; `same`:
 * does a kind of that name exclude this one? */
static enum imp_status append(imp_context *ctx, const char *function,
                              enum imp_concept concept, const void *ops, size_t size,
                              bool (*same)(const void *ops, const void *other))
{
    enum imp_status st = IMP_OK;
    const struct head h = head_of(ops);
    struct imp_registered *r = NULL;
    if (!h.name || !name_fits(h.name))
        return imp__error(ctx, IMP_E_ARG,
                          "%s: ops: a name is letters, digits, '_' and '-'", function);
    if (h.object_size > ((size_t)1 << 30))
        return imp__error(ctx, IMP_E_ARG, "%s: ops: object_size %zu", function,
                          h.object_size);
    for (size_t i = 0; built_in(concept, i); i++)
        if (strcmp(head_of(built_in(concept, i)).name, h.name) == 0)
            return imp__error(ctx, IMP_E_ARG, "%s: ops: '%s' is a built-in kind",
                              function, h.name);
    r = imp__alloc(ctx, 1, sizeof *r + size);
    if (!r) return imp__error(ctx, IMP_E_NOMEM, "%s: out of memory", function);
    r->concept = (int)concept;
    memcpy(r->ops, ops, size);

    imp__context_own(ctx);
    pthread_mutex_lock(&ctx->lock);
    struct imp_registered **end = &ctx->kinds;
    bool twice = false;
    for (; *end; end = &(*end)->next)
    twice |= (*end)->concept == (int)concept &&
             strcmp(head_of((*end)->ops).name, h.name) == 0 &&
             (!same || same(ops, (*end)->ops));
    const bool late = ctx->has_scenes;
    if (!twice && !late) *end = r;
    pthread_mutex_unlock(&ctx->lock);

    if (late)
        IMP_TRY(imp__error(ctx, IMP_E_ARG,
                           "%s: ops: '%s' comes after a scene of this context was made",
                           function, h.name));
    if (twice)
        IMP_TRY(imp__error(ctx, IMP_E_ARG, "%s: ops: '%s' is registered already",
                           function, h.name));
    return IMP_OK;
out:
    imp__release(ctx, r);
    return st;
}

/* "imp_register_bsdf: ops: 'minnaert' has no eval_d" */
#define NEEDS(own, function)                                                             \
    do {                                                                                 \
        if (!(own).function)                                                             \
            return imp__error(context, IMP_E_ARG, "%s: ops: '%s' has no " #function,     \
                              __func__, (own).name ? (own).name : "");                   \
    } while (0)
#define NEEDS_BOTH_OR_NEITHER(own, one, other)                                           \
    do {                                                                                 \
        if (!(own).one != !(own).other)                                                  \
            return imp__error(context, IMP_E_ARG,                                        \
                              "%s: ops: '%s' has only one of " #one " and " #other,      \
                              __func__, (own).name ? (own).name : "");                   \
    } while (0)
#define CHILDREN(own)                                                                    \
    do {                                                                                 \
        if ((own).min_children < 0 || (own).max_children > 2 ||                          \
            (own).min_children > (own).max_children)                                     \
            return imp__error(                                                           \
                context, IMP_E_ARG, "%s: ops: '%s' takes %d to %d children", __func__,   \
                (own).name ? (own).name : "", (own).min_children, (own).max_children);   \
    } while (0)
#define TAKE(own)                                                                        \
    IMP_REQUIRE(NULL, context, "context");                                               \
    IMP_REQUIRE(context, ops, "ops");                                                    \
    IMP_CHECKED(take(context, __func__, ops, &(own), sizeof(own)))

enum imp_status imp_register_bsdf(imp_context *context, const struct imp_bsdf_ops *ops)
{
    struct imp_bsdf_ops own = {0};
    TAKE(own);
    NEEDS(own, sample);
    NEEDS(own, eval);
    NEEDS(own, pdf);
    NEEDS(own, eval_d);
    NEEDS_BOTH_OR_NEITHER(own, emit, emit_d);
    CHILDREN(own);
    IMP_CHECKED(inputs_check(context, __func__, own.inputs));
    return append(context, __func__, IMP_CONCEPT_BSDF, &own, sizeof own, NULL);
}

/* Inputs of textures and volumes, which are looked up one by one. */
static enum imp_status texture_inputs_check(imp_context *context, const char *function,
                                            const struct imp_input_desc *inputs)
{
    IMP_CHECKED(inputs_check(context, function, inputs));
    for (const struct imp_input_desc *d = inputs; d && d->name; d++)
        if (d->flags & (IMP_INPUT_LUMINANCE | IMP_INPUT_WAVELENGTH))
            return imp__error(
                context, IMP_E_ARG, "%s: ops: input '%s': IMP_INPUT_%s in a texture",
                function, d->name,
                d->flags & IMP_INPUT_LUMINANCE ? "LUMINANCE" : "WAVELENGTH");
    return IMP_OK;
}

enum imp_status imp_register_texture(imp_context *context,
                                     const struct imp_texture_ops *ops)
{
    struct imp_texture_ops own = {0};
    TAKE(own);
    NEEDS(own, eval);
    NEEDS(own, scatter);
    NEEDS(own, tangent);
    IMP_CHECKED(texture_inputs_check(context, __func__, own.inputs));
    return append(context, __func__, IMP_CONCEPT_TEXTURE, &own, sizeof own, NULL);
}

enum imp_status imp_register_volume(imp_context *context,
                                    const struct imp_texture_ops *ops)
{
    struct imp_texture_ops own = {0};
    TAKE(own);
    NEEDS(own, eval);
    NEEDS(own, scatter);
    NEEDS(own, tangent);
    IMP_CHECKED(texture_inputs_check(context, __func__, own.inputs));
    return append(context, __func__, IMP_CONCEPT_VOLUME, &own, sizeof own, NULL);
}

enum imp_status imp_register_phase(imp_context *context, const struct imp_phase_ops *ops)
{
    struct imp_phase_ops own = {0};
    TAKE(own);
    NEEDS(own, sample);
    NEEDS(own, eval);
    NEEDS(own, pdf);
    NEEDS(own, eval_d);
    CHILDREN(own);
    IMP_CHECKED(inputs_check(context, __func__, own.inputs));
    return append(context, __func__, IMP_CONCEPT_PHASE, &own, sizeof own, NULL);
}

enum imp_status imp_register_medium(imp_context *context,
                                    const struct imp_medium_ops *ops)
{
    struct imp_medium_ops own = {0};
    TAKE(own);
    NEEDS(own, eval);
    NEEDS(own, eval_d);
    IMP_CHECKED(inputs_check(context, __func__, own.inputs));
    return append(context, __func__, IMP_CONCEPT_MEDIUM, &own, sizeof own, NULL);
}

enum imp_status imp_register_shape(imp_context *context, const struct imp_shape_ops *ops)
{
    struct imp_shape_ops own = {0};
    TAKE(own);
    NEEDS(own, build);
    NEEDS(own, surface);
    NEEDS_BOTH_OR_NEITHER(own, sample_toward, pdf_toward);
    return append(context, __func__, IMP_CONCEPT_SHAPE, &own, sizeof own, NULL);
}

static bool both_in_shapes(const void *ops, const void *other)
{
    const struct imp_emitter_ops *a = ops, *b = other;
    return (a->flags & IMP_EMITTER_AREA) == (b->flags & IMP_EMITTER_AREA);
}

enum imp_status imp_register_emitter(imp_context *context,
                                     const struct imp_emitter_ops *ops)
{
    struct imp_emitter_ops own = {0};
    TAKE(own);
    NEEDS(own, eval);
    NEEDS(own, eval_d);
    NEEDS(own, sample);
    if (!(own.flags & IMP_EMITTER_DELTA)) NEEDS(own, pdf);
    IMP_CHECKED(inputs_check(context, __func__, own.inputs));
    return append(context, __func__, IMP_CONCEPT_EMITTER, &own, sizeof own,
                  both_in_shapes);
}

enum imp_status imp_register_sensor(imp_context *context,
                                    const struct imp_sensor_ops *ops)
{
    struct imp_sensor_ops own = {0};
    TAKE(own);
    NEEDS(own, build);
    NEEDS(own, ray);
    return append(context, __func__, IMP_CONCEPT_SENSOR, &own, sizeof own, NULL);
}

enum imp_status imp_register_filter(imp_context *context,
                                    const struct imp_filter_ops *ops)
{
    struct imp_filter_ops own = {0};
    TAKE(own);
    NEEDS(own, build);
    NEEDS(own, eval);
    return append(context, __func__, IMP_CONCEPT_FILTER, &own, sizeof own, NULL);
}
