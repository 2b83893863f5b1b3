/* SPDX-License-Identifier: Apache-2.0
 *
 * How build functions read the properties of an object (kinds.h): the property bag of
 * base/props.h with the object filled in. */
#include "base/arguments.h"
#include "build.h"
#include <stdio.h>

/* A property's name comes with every call. */
#define REQUIRE_NAMED(build, name, out)                                                  \
    do {                                                                                 \
        IMP_REQUIRE(NULL, build, "build");                                               \
        IMP_REQUIRE((build)->ctx, name, "name");                                         \
        IMP_REQUIRE((build)->ctx, out, "out");                                           \
    } while (0)

enum imp_status imp_build_bool(const struct imp_build *build, const char *name,
                               bool fallback, bool *out)
{
    REQUIRE_NAMED(build, name, out);
    return imp__props_bool(build->ctx, build->node, name, fallback, out);
}

enum imp_status imp_build_int(const struct imp_build *build, const char *name,
                              int64_t fallback, int64_t lo, int64_t hi, int64_t *out)
{
    REQUIRE_NAMED(build, name, out);
    return imp__props_int(build->ctx, build->node, name, fallback, lo, hi, out);
}

enum imp_status imp_build_float(const struct imp_build *build, const char *name,
                                double fallback, double *out)
{
    REQUIRE_NAMED(build, name, out);
    IMP_FINITE(build->ctx, fallback, "fallback");
    return imp__props_float(build->ctx, build->node, name, fallback, out);
}

enum imp_status imp_build_string(const struct imp_build *build, const char *name,
                                 const char *fallback, const char **out)
{
    REQUIRE_NAMED(build, name, out);
    return imp__props_string(build->ctx, build->node, name, fallback, out);
}

enum imp_status imp_build_vector(const struct imp_build *build, const char *name,
                                 const double fallback[3], double out[3])
{
    REQUIRE_NAMED(build, name, out);
    IMP_REQUIRE(build->ctx, fallback, "fallback");
    IMP_FINITE_ALL(build->ctx, fallback, 3, "fallback");
    return imp__props_vector(build->ctx, build->node, name, fallback, out);
}

enum imp_status imp_build_transform(const struct imp_build *build, const char *name,
                                    double out[16])
{
    REQUIRE_NAMED(build, name, out);
    return imp__props_transform(build->ctx, build->node, name, out);
}

enum imp_status imp_build_choice(const struct imp_build *build, const char *name,
                                 const char *const *words, int n, int fallback, int *out)
{
    REQUIRE_NAMED(build, name, out);
    IMP_REQUIRE(build->ctx, words, "words");
    return imp__props_choice(build->ctx, build->node, name, words, n, fallback, out);
}

bool imp_build_has(const struct imp_build *build, const char *name)
{
    IMP_REQUIRE_OR(NULL, build, "build", false);
    IMP_REQUIRE_OR(build->ctx, name, "name", false);
    return imp__props_has(build->node, name);
}

enum imp_status imp_build_error(const struct imp_build *build, const char *name,
                                enum imp_status status, const char *format, ...)
{
    char text[1024];
    va_list args;
    IMP_REQUIRE(NULL, build, "build");
    IMP_REQUIRE(build->ctx, format, "format");
    va_start(args, format);
    vsnprintf(text, sizeof text, format, args);
    va_end(args);
    return imp__prop_error(build->ctx, build->node,
                           name ? imp__node_prop(build->node, name) : NULL, status, "%s",
                           text);
}

void *imp_build_alloc(const struct imp_build *build, size_t n, size_t size)
{
    IMP_REQUIRE_OR(NULL, build, "build", NULL);
    return imp__arena_array(build->arena, n, size);
}

enum imp_color_mode imp_build_color_mode(const struct imp_build *build)
{
    IMP_REQUIRE_OR(NULL, build, "build", IMP_RGB);
    return build->mode;
}

enum imp_status imp_build_set(const struct imp_build *build, const char *name, size_t n,
                              const double *values)
{
    IMP_REQUIRE(NULL, build, "build");
    IMP_REQUIRE(build->ctx, name, "name");
    IMP_REQUIRE(build->ctx, values, "values");
    if (n != 1 && n != 3)
        return imp__error(build->ctx, IMP_E_ARG, "%s: n = %zu: one number, or three",
                          __func__, n);
    IMP_FINITE_ALL(build->ctx, values, n, "values");
    struct imp_node *node = build->node;
    if (imp__node_prop(node, name) || imp__node_child(node, name))
        return imp__error(build->ctx, IMP_E_ARG, "%s: '%s' is written already", __func__,
                          name);
    struct imp_prop *p = imp__node_add(build->arena, node, name,
                                       n == 3 ? IMP_PROP_RGB : IMP_PROP_FLOAT, node->loc);
    if (!p) return imp__error(build->ctx, IMP_E_NOMEM, "%s: out of memory", __func__);
    for (size_t c = 0; c < n; c++) p->number[c] = values[c];
    return IMP_OK;
}

enum imp_status imp_build_texels(const struct imp_build *build, const char *key,
                                 float *data, int n_dims, const size_t *dims,
                                 unsigned flags, double lo, double hi, int *param)
{
    IMP_REQUIRE(NULL, build, "build");
    IMP_REQUIRE(build->ctx, key, "key");
    IMP_REQUIRE(build->ctx, data, "data");
    IMP_REQUIRE(build->ctx, dims, "dims");
    IMP_REQUIRE(build->ctx, param, "param");
    const int least = flags & IMP_PARAM_VOLUME ? 3 : 1,
              most = flags & IMP_PARAM_VOLUME ? 4 : 3;
    if (n_dims < least || n_dims > most)
        return imp__error(build->ctx, IMP_E_ARG, "%s: n_dims = %d is outside [%d, %d]",
                          __func__, n_dims, least, most);
    if (!(lo <= hi))
        return imp__error(build->ctx, IMP_E_ARG, "%s: lo = %g is above hi = %g", __func__,
                          lo, hi);
    return build->add_bulk(build, key, data, n_dims, dims, flags, lo, hi, param);
}
