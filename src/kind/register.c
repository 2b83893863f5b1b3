/* SPDX-License-Identifier: Apache-2.0
 *
 * Registering a kind: is its table of this library's making, whole, and the only one of its
 * name? What a table must have is data, a row for each concept. */
#include "base/arguments.h"
#include "layout.h"
#include "registry.h"
#include <math.h>
#include <stddef.h>
#include <stdio.h>
#include <string.h>

#define BEGINS_WITH_HEAD(ops)                                                            \
    _Static_assert(offsetof(struct ops, name) == offsetof(struct imp_kind_head, name) && \
                       offsetof(struct ops, object_size) ==                              \
                           offsetof(struct imp_kind_head, object_size),                  \
                   #ops)
BEGINS_WITH_HEAD(imp_bsdf_ops);
BEGINS_WITH_HEAD(imp_texture_ops);
BEGINS_WITH_HEAD(imp_shape_ops);
BEGINS_WITH_HEAD(imp_emitter_ops);
BEGINS_WITH_HEAD(imp_sensor_ops);
BEGINS_WITH_HEAD(imp_filter_ops);
BEGINS_WITH_HEAD(imp_phase_ops);
BEGINS_WITH_HEAD(imp_medium_ops);

/* A copy of a table, as large as the largest; the union of all tables. */
union table {
    struct imp_kind_head head;
    struct imp_bsdf_ops bsdf;
    struct imp_texture_ops texture;
    struct imp_shape_ops shape;
    struct imp_emitter_ops emitter;
    struct imp_sensor_ops sensor;
    struct imp_filter_ops filter;
    struct imp_phase_ops phase;
    struct imp_medium_ops medium;
};

/* A function of the table that must be there. */
struct needed {
    const char *name; /* NULL ends the list */
    size_t at;
};
#define NEEDED(concept, function)                                                        \
    {                                                                                    \
#function, offsetof(struct imp_##concept##_ops, function)                        \
    }

/* ---- What is wrong with a table --------------------------------------------------- */

static bool is_there(const union table *own, size_t at)
{
    void (*function)(void);
    memcpy(&function, (const char *)own + at, sizeof function);
    return function != NULL;
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

/* Components in a row that end before input n, all of one name. */
static size_t components_before(const struct imp_input_desc *inputs, size_t n)
{
    size_t k = 0;
    while (k < n && inputs[n - 1 - k].flags & IMP_INPUT_COMPONENT &&
           strcmp(inputs[n - 1 - k].name, inputs[n - 1].name) == 0)
        k++;
    return k;
}
/* Three in a row, after their vector. */
static enum imp_status component_check(imp_context *ctx, const char *function,
                                       const struct imp_input_desc *inputs, size_t n)
{
    const char *name = inputs[n].name;
    if (name && inputs[n].flags & IMP_INPUT_COMPONENT) {
        size_t k = 0;
        while (k < n && inputs[n - 1 - k].flags & IMP_INPUT_COMPONENT &&
               strcmp(inputs[n - 1 - k].name, name) == 0)
            k++;
        const struct imp_input_desc *of = k < n ? &inputs[n - 1 - k] : NULL;
        if (k < 3 && of && strcmp(of->name, name) == 0 &&
            of->flags & (IMP_INPUT_VECTOR | IMP_INPUT_BUMP))
            return IMP_OK;
    } else if (components_before(inputs, n) == 3) {
        return IMP_OK;
    } else {
        name = inputs[n - 1].name;
    }
    return imp__error(
        ctx, IMP_E_ARG,
        "%s: ops: input '%s': IMP_INPUT_COMPONENT is of three in a row after "
        "the vector of this name",
        function, name);
}

static enum imp_status input_check(imp_context *ctx, const char *function,
                                   const struct imp_input_desc *inputs, size_t n)
{
    const struct imp_input_desc *d = &inputs[n];
    if (!name_fits(d->name))
        return imp__error(ctx, IMP_E_ARG, "%s: ops: input %zu has no proper name",
                          function, n);
    if (!isfinite(d->fallback) || !(d->lo <= d->hi || (d->lo == 0 && d->hi == 0)))
        return imp__error(ctx, IMP_E_ARG,
                          "%s: ops: input '%s': fallback %g, bounds [%g, %g]", function,
                          d->name, d->fallback, d->lo, d->hi);
    if (d->flags & IMP_INPUT_FALLS &&
        (!(d->flags & IMP_INPUT_EXTINCTION) || d->flags & IMP_INPUT_VOLUME))
        return imp__error(ctx, IMP_E_ARG,
                          "%s: ops: input '%s': IMP_INPUT_FALLS goes with "
                          "IMP_INPUT_EXTINCTION, and not with IMP_INPUT_VOLUME",
                          function, d->name);
    bool before = false; /* under the same name */
    for (size_t k = 0; k < n; k++) before |= strcmp(inputs[k].name, d->name) == 0;
    const bool luminance = d->flags & IMP_INPUT_LUMINANCE;
    if (d->flags & IMP_INPUT_COMPONENT || components_before(inputs, n) > 0)
        IMP_CHECKED(component_check(ctx, function, inputs, n));
    if (d->flags & IMP_INPUT_COMPONENT) return IMP_OK;
    if (before && !luminance)
        return imp__error(ctx, IMP_E_ARG, "%s: ops: two inputs '%s'", function, d->name);
    if (!before && luminance)
        return imp__error(ctx, IMP_E_ARG, "%s: ops: no input '%s' before its luminance",
                          function, d->name);
    return IMP_OK;
}

static enum imp_status inputs_check(imp_context *ctx, const char *function,
                                    const struct imp_input_desc *inputs)
{
    size_t n = 0;
    for (; inputs && inputs[n].name; n++)
        IMP_CHECKED(input_check(ctx, function, inputs, n));
    if (components_before(inputs, n) > 0)
        IMP_CHECKED(component_check(ctx, function, inputs, n));
    if (n > IMP_INPUTS_MAX)
        return imp__error(ctx, IMP_E_ARG, "%s: ops: %zu inputs; at most %d", function, n,
                          IMP_INPUTS_MAX);
    return IMP_OK;
}

static enum imp_status pair_check(imp_context *ctx, const char *function,
                                  const union table *own, const struct needed pair[2])
{
    if (!pair[0].name || is_there(own, pair[0].at) == is_there(own, pair[1].at))
        return IMP_OK;
    return imp__error(ctx, IMP_E_ARG, "%s: ops: '%s' has only one of %s and %s", function,
                      own->head.name, pair[0].name, pair[1].name);
}

/* ---- Checks of one concept --------------------------------------------------------- */

static enum imp_status bsdf_check(imp_context *ctx, const char *function,
                                  const union table *own)
{
    const int least = own->bsdf.min_children, most = own->bsdf.max_children;
    if (least < 0 || most > 2 || least > most)
        return imp__error(ctx, IMP_E_ARG, "%s: ops: '%s' takes %d to %d children",
                          function, own->head.name, least, most);
    return inputs_check(ctx, function, own->bsdf.inputs);
}

static enum imp_status phase_check(imp_context *ctx, const char *function,
                                   const union table *own)
{
    const int least = own->phase.min_children, most = own->phase.max_children;
    if (least < 0 || most > 2 || least > most)
        return imp__error(ctx, IMP_E_ARG, "%s: ops: '%s' takes %d to %d children",
                          function, own->head.name, least, most);
    return inputs_check(ctx, function, own->phase.inputs);
}

static enum imp_status medium_check(imp_context *ctx, const char *function,
                                    const union table *own)
{
    return inputs_check(ctx, function, own->medium.inputs);
}

/* Inputs of textures and volumes, which are looked up one by one. */
static enum imp_status texture_check(imp_context *ctx, const char *function,
                                     const union table *own)
{
    IMP_CHECKED(inputs_check(ctx, function, own->texture.inputs));
    for (const struct imp_input_desc *d = own->texture.inputs; d && d->name; d++)
        if (d->flags & (IMP_INPUT_LUMINANCE | IMP_INPUT_WAVELENGTH | IMP_INPUT_COMPONENT))
            return imp__error(ctx, IMP_E_ARG,
                              "%s: ops: input '%s': IMP_INPUT_%s in a texture", function,
                              d->name,
                              d->flags & IMP_INPUT_LUMINANCE    ? "LUMINANCE"
                              : d->flags & IMP_INPUT_WAVELENGTH ? "WAVELENGTH"
                                                                : "COMPONENT");
    if (own->texture.place && !(own->texture.gradient && own->texture.extent))
        return imp__error(ctx, IMP_E_ARG, "%s: ops: '%s' has place, but no %s", function,
                          own->head.name, own->texture.gradient ? "extent" : "gradient");
    return IMP_OK;
}

static enum imp_status emitter_check(imp_context *ctx, const char *function,
                                     const union table *own)
{
    if (!(own->emitter.flags & IMP_EMITTER_DELTA) && !own->emitter.pdf)
        return imp__error(ctx, IMP_E_ARG, "%s: ops: '%s' has no pdf", function,
                          own->head.name);
    return inputs_check(ctx, function, own->emitter.inputs);
}

/* Two lights may share a name, one of its own and one in a shape. */
static bool both_in_shapes(const void *ops, const void *other)
{
    const struct imp_emitter_ops *a = ops, *b = other;
    return (a->flags & IMP_EMITTER_AREA) == (b->flags & IMP_EMITTER_AREA);
}

/* ---- The concepts ------------------------------------------------------------------ */

struct row {
    const char *function; /* as the header calls it, for messages */
    size_t size;          /* of its table */
    struct needed needs[5], pair[2];
    enum imp_status (*check)(imp_context *ctx, const char *function,
                             const union table *own); /* NULL: nothing else */
    /* Does a kind of the same name exclude this one? NULL: it does. */
    bool (*same)(const void *ops, const void *other);
};
#define ROW(concept)                                                                     \
    .function = "imp_register_" #concept, .size = sizeof(struct imp_##concept##_ops)
static const struct row rows[] = {
    [IMP_CONCEPT_BSDF] = {ROW(bsdf),
                          .needs = {NEEDED(bsdf, sample), NEEDED(bsdf, eval),
                                    NEEDED(bsdf, pdf), NEEDED(bsdf, eval_d)},
                          .pair = {NEEDED(bsdf, emit), NEEDED(bsdf, emit_d)},
                          .check = bsdf_check},
    [IMP_CONCEPT_TEXTURE] = {ROW(texture),
                             .needs = {NEEDED(texture, eval), NEEDED(texture, scatter),
                                       NEEDED(texture, tangent)},
                             .pair = {NEEDED(texture, slope_scatter),
                                      NEEDED(texture, slope_tangent)},
                             .check = texture_check},
    [IMP_CONCEPT_VOLUME] = {.function = "imp_register_volume",
                            .size = sizeof(struct imp_texture_ops),
                            .needs = {NEEDED(texture, eval), NEEDED(texture, scatter),
                                      NEEDED(texture, tangent)},
                            .check = texture_check},
    [IMP_CONCEPT_PHASE] = {ROW(phase),
                           .needs = {NEEDED(phase, sample), NEEDED(phase, eval),
                                     NEEDED(phase, pdf), NEEDED(phase, eval_d)},
                           .check = phase_check},
    [IMP_CONCEPT_MEDIUM] = {ROW(medium),
                            .needs = {NEEDED(medium, eval), NEEDED(medium, eval_d)},
                            .check = medium_check},
    [IMP_CONCEPT_SHAPE] = {ROW(shape),
                           .needs = {NEEDED(shape, build), NEEDED(shape, surface)},
                           .pair = {NEEDED(shape, sample_toward),
                                    NEEDED(shape, pdf_toward)}},
    [IMP_CONCEPT_EMITTER] = {ROW(emitter),
                             .needs = {NEEDED(emitter, eval), NEEDED(emitter, eval_d),
                                       NEEDED(emitter, sample)},
                             .check = emitter_check, .same = both_in_shapes},
    [IMP_CONCEPT_SENSOR] = {ROW(sensor),
                            .needs = {NEEDED(sensor, build), NEEDED(sensor, ray)}},
    [IMP_CONCEPT_FILTER] = {ROW(filter),
                            .needs = {NEEDED(filter, build), NEEDED(filter, eval)}}};

/* The table, completed by zeros where it is older; a newer one expects objects with
 * fields that are not there. */
static enum imp_status take(imp_context *ctx, const struct row *row, const void *ops,
                            union table *own)
{
    size_t size;
    memcpy(&size, ops, sizeof size);
    if (size > row->size)
        return imp__error(
            ctx, IMP_E_ARG,
            "%s: size %zu of ops is not the size of that struct (%zu here): "
            "it was compiled with another kinds.h",
            row->function, size, row->size);
    memset(own, 0, sizeof *own);
    return imp__options_take(ctx, row->function, "ops", ops, own, row->size);
}

static enum imp_status table_check(imp_context *ctx, const struct row *row,
                                   enum imp_concept concept, const union table *own)
{
    const struct imp_kind_head *h = &own->head;
    if (!h->name || !name_fits(h->name))
        return imp__error(ctx, IMP_E_ARG,
                          "%s: ops: a name is letters, digits, '_' and '-'",
                          row->function);
    for (const struct needed *f = row->needs; f->name; f++)
        if (!is_there(own, f->at))
            return imp__error(ctx, IMP_E_ARG, "%s: ops: '%s' has no %s", row->function,
                              h->name, f->name);
    IMP_CHECKED(pair_check(ctx, row->function, own, row->pair));
    if (row->check) IMP_CHECKED(row->check(ctx, row->function, own));
    if (h->object_size > ((size_t)1 << 30))
        return imp__error(ctx, IMP_E_ARG, "%s: ops: object_size %zu", row->function,
                          h->object_size);
    for (size_t i = 0; imp__kind_built_in(concept, i); i++)
        if (strcmp(imp__kind_head(imp__kind_built_in(concept, i)).name, h->name) == 0)
            return imp__error(ctx, IMP_E_ARG, "%s: ops: '%s' is a built-in kind",
                              row->function, h->name);
    return IMP_OK;
}

static enum imp_status append(imp_context *ctx, const struct row *row,
                              enum imp_concept concept, const union table *own)
{
    enum imp_status st = IMP_OK;
    const char *name = own->head.name;
    struct imp_registered *r = imp__alloc(ctx, 1, sizeof *r + row->size);
    if (!r) return imp__error(ctx, IMP_E_NOMEM, "%s: out of memory", row->function);
    r->concept = (int)concept;
    memcpy(r->ops, own, row->size);

    imp__context_own(ctx);
    pthread_mutex_lock(&ctx->lock);
    struct imp_registered **end = &ctx->kinds;
    bool twice = false;
    for (; *end; end = &(*end)->next)
    twice |= (*end)->concept == (int)concept &&
             strcmp(imp__kind_head((*end)->ops).name, name) == 0 &&
             (!row->same || row->same(own, (*end)->ops));
    const bool late = ctx->has_scenes;
    if (!twice && !late) *end = r;
    pthread_mutex_unlock(&ctx->lock);

    if (late)
        IMP_TRY(imp__error(ctx, IMP_E_ARG,
                           "%s: ops: '%s' comes after a scene of this context was made",
                           row->function, name));
    if (twice)
        IMP_TRY(imp__error(ctx, IMP_E_ARG, "%s: ops: '%s' is registered already",
                           row->function, name));
    return IMP_OK;
out:
    imp__release(ctx, r);
    return st;
}

enum imp_status imp_register_kind(imp_context *context, enum imp_concept concept,
                                  const void *ops, const struct imp_kinds_layout *layout)
{
    union table own;
    IMP_REQUIRE(NULL, context, "context");
    IMP_REQUIRE(context, ops, "ops");
    IMP_REQUIRE(context, layout, "layout");
    if ((size_t) concept >= imp_count(rows))
        return imp__error(context, IMP_E_ARG, "%s: concept is %d, which is none",
                          __func__, (int)concept);
    const struct row *row = &rows[concept];
    IMP_CHECKED(imp__kinds_layout_check(context, row->function, layout));
    IMP_CHECKED(take(context, row, ops, &own));
    IMP_CHECKED(table_check(context, row, concept, &own));
    return append(context, row, concept, &own);
}
