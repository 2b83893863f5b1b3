/* SPDX-License-Identifier: Apache-2.0
 *
 * Nodes and properties of a scene's tree: creation, typed reading with defaults and
 * ranges, and errors that name the place where a value was written. */
#include "props.h"
#include "nearest.h"
#include <math.h>
#include <stdio.h>
#include <string.h>
#include <strings.h>

static const char *const type_names[] = {
    [IMP_PROP_BOOL] = "a boolean",        [IMP_PROP_INTEGER] = "an integer",
    [IMP_PROP_FLOAT] = "a float",         [IMP_PROP_STRING] = "a string",
    [IMP_PROP_VECTOR] = "a vector",       [IMP_PROP_RGB] = "an rgb",
    [IMP_PROP_UNIFORM] = "a spectrum",    [IMP_PROP_SPECTRUM] = "a spectrum",
    [IMP_PROP_TRANSFORM] = "a transform", [IMP_PROP_REF] = "a ref"};

struct imp_node *imp__node_create(struct imp_arena *a, const char *tag, const char *type,
                                  const char *id, const char *name, struct imp_loc loc)
{
    struct imp_node *n = imp__arena_array(a, 1, sizeof *n);
    if (!n) return NULL;
    n->tag = imp__arena_strdup(a, tag);
    n->type = imp__arena_strdup(a, type ? type : "");
    n->id = id ? imp__arena_strdup(a, id) : NULL;
    n->name = name ? imp__arena_strdup(a, name) : NULL;
    n->loc = loc;
    return n->tag && n->type && !n->id == !id && !n->name == !name ? n : NULL;
}

/* Arrays grow inside the arena; the old ones stay until it is freed (sizes double). */
static void *array_grow(struct imp_arena *a, void *old, size_t n, size_t *cap,
                        size_t size)
{
    if (n < *cap) return old;
    const size_t wanted = *cap ? 2 * *cap : 4;
    void *p = imp__arena_array(a, wanted, size);
    if (!p) return NULL;
    if (n) memcpy(p, old, n * size);
    *cap = wanted;
    return p;
}

struct imp_prop *imp__node_add(struct imp_arena *a, struct imp_node *node,
                               const char *name, enum imp_prop_type type,
                               struct imp_loc loc)
{
    struct imp_prop *p =
        array_grow(a, node->props, node->n_props, &node->cap_props, sizeof *p);
    if (!p) return NULL;
    node->props = p;
    char *copy = imp__arena_strdup(a, name);
    if (!copy) return NULL;
    p += node->n_props++;
    *p = (struct imp_prop){.name = copy, .type = type, .loc = loc};
    return p;
}

struct imp_child *imp__node_add_child(struct imp_arena *a, struct imp_node *parent,
                                      struct imp_node *child, const char *name,
                                      struct imp_loc loc)
{
    struct imp_child *c = array_grow(a, parent->children, parent->n_children,
                                     &parent->cap_children, sizeof *c);
    if (!c) return NULL;
    parent->children = c;
    char *copy = name ? imp__arena_strdup(a, name) : NULL;
    if (name && !copy) return NULL;
    c += parent->n_children++;
    *c = (struct imp_child){.name = copy, .node = child, .loc = loc};
    return c;
}

void imp__node_remove(struct imp_node *node, const char *name)
{
    struct imp_prop *p = imp__node_prop(node, name);
    if (!p) return;
    if (p < node->props + node->given_props) node->given_props--;
    memmove(p, p + 1, (size_t)(node->props + node->n_props - (p + 1)) * sizeof *p);
    node->n_props--;
}

struct imp_prop *imp__node_prop(const struct imp_node *node, const char *name)
{
    for (size_t i = 0; i < node->n_props; i++)
        if (strcmp(node->props[i].name, name) == 0) return &node->props[i];
    return NULL;
}

struct imp_child *imp__node_child(const struct imp_node *node, const char *name)
{
    for (size_t i = 0; i < node->n_children; i++) {
        struct imp_child *c = &node->children[i];
        if (c->name && strcmp(c->name, name) == 0) return c;
    }
    return NULL;
}

const char *imp__loc_text(struct imp_loc loc, char *buffer, size_t size)
{
    if (loc.file) snprintf(buffer, size, "%s:%d:%d", loc.file, loc.line, loc.column);
    else snprintf(buffer, size, "scene");
    return buffer;
}

static enum imp_status error_at(imp_context *ctx, const struct imp_node *node,
                                struct imp_loc loc, enum imp_status status,
                                const char *format, va_list args)
{
    char where[512], text[1024];
    vsnprintf(text, sizeof text, format, args);
    imp__loc_text(loc, where, sizeof where);
    const char *id = node->id ? node->id : "";
    return imp__error(ctx, status, "%s: %s%s%s%s%s%s%s: %s", where, node->tag,
                      *id ? " '" : "", id, *id ? "'" : "", *node->type ? " (" : "",
                      node->type, *node->type ? ")" : "", text);
}

enum imp_status imp__node_error(imp_context *ctx, const struct imp_node *node,
                                enum imp_status status, const char *format, ...)
{
    va_list args;
    va_start(args, format);
    error_at(ctx, node, node->loc, status, format, args);
    va_end(args);
    return status;
}

enum imp_status imp__prop_error(imp_context *ctx, const struct imp_node *node,
                                const struct imp_prop *prop, enum imp_status status,
                                const char *format, ...)
{
    va_list args;
    va_start(args, format);
    error_at(ctx, node, prop ? prop->loc : node->loc, status, format, args);
    va_end(args);
    return status;
}

void imp__node_ask(struct imp_node *node, const char *name)
{
    for (int i = 0; i < node->n_asked; i++)
        if (strcmp(node->asked[i], name) == 0) return;
    if (node->n_asked < (int)imp_count(node->asked)) node->asked[node->n_asked++] = name;
}

/* The property, marked as used, if it is there and of this type; an integer passes for a
 * float. A child in this slot is a type error too. */
static enum imp_status find(imp_context *ctx, struct imp_node *node, const char *name,
                            enum imp_prop_type type, struct imp_prop **out)
{
    struct imp_prop *p = imp__node_prop(node, name);
    *out = NULL;
    imp__node_ask(node, name);
    if (!p) {
        const struct imp_child *c = imp__node_child(node, name);
        if (!c) return IMP_OK;
        return imp__node_error(ctx, node, IMP_E_SCENE,
                               "property '%s' must be %s, not an object", name,
                               type_names[type]);
    }
    p->used = true;
    if (p->type != type && !(type == IMP_PROP_FLOAT && p->type == IMP_PROP_INTEGER))
        return imp__prop_error(ctx, node, p, IMP_E_SCENE,
                               "property '%s' must be %s, not %s", name, type_names[type],
                               type_names[p->type]);
    *out = p;
    return IMP_OK;
}

enum imp_status imp__props_bool(imp_context *ctx, struct imp_node *node, const char *name,
                                bool fallback, bool *out)
{
    struct imp_prop *p;
    const enum imp_status st = find(ctx, node, name, IMP_PROP_BOOL, &p);
    if (st == IMP_OK) *out = p ? p->integer != 0 : fallback;
    return st;
}

enum imp_status imp__props_int(imp_context *ctx, struct imp_node *node, const char *name,
                               int64_t fallback, int64_t lo, int64_t hi, int64_t *out)
{
    struct imp_prop *p;
    const enum imp_status st = find(ctx, node, name, IMP_PROP_INTEGER, &p);
    if (st != IMP_OK) return st;
    const int64_t v = p ? p->integer : fallback;
    if (v < lo || v > hi)
        return imp__prop_error(ctx, node, p, IMP_E_SCENE,
                               "%s = %lld is outside [%lld, %lld]", name, (long long)v,
                               (long long)lo, (long long)hi);
    *out = v;
    return IMP_OK;
}

enum imp_status imp__props_float(imp_context *ctx, struct imp_node *node,
                                 const char *name, double fallback, double *out)
{
    struct imp_prop *p;
    const enum imp_status st = find(ctx, node, name, IMP_PROP_FLOAT, &p);
    if (st != IMP_OK) return st;
    const double v = !p                            ? fallback
                     : p->type == IMP_PROP_INTEGER ? (double)p->integer
                                                   : p->number[0];
    if (!isfinite(v))
        return imp__prop_error(ctx, node, p, IMP_E_SCENE, "%s = %g is not finite", name,
                               v);
    *out = v;
    return IMP_OK;
}

static bool is_in(double v, struct imp_interval r)
{
    return (r.open & IMP_OPEN_LO ? v > r.lo : v >= r.lo) &&
           (r.open & IMP_OPEN_HI ? v < r.hi : v <= r.hi);
}

enum imp_status imp__props_float_in(imp_context *ctx, struct imp_node *node,
                                    const char *name, double fallback,
                                    struct imp_interval range, double *out)
{
    const enum imp_status st = imp__props_float(ctx, node, name, fallback, out);
    const struct imp_prop *p = imp__node_prop(node, name);
    if (st != IMP_OK || !p || is_in(*out, range)) return st;
    return imp__prop_error(ctx, node, p, IMP_E_SCENE, "%s = %g is outside %s%g, %g%s",
                           name, *out, range.open & IMP_OPEN_LO ? "(" : "[", range.lo,
                           range.hi, range.open & IMP_OPEN_HI ? ")" : "]");
}

enum imp_status imp__props_string(imp_context *ctx, struct imp_node *node,
                                  const char *name, const char *fallback,
                                  const char **out)
{
    struct imp_prop *p;
    const enum imp_status st = find(ctx, node, name, IMP_PROP_STRING, &p);
    if (st == IMP_OK) *out = p ? p->string : fallback;
    return st;
}

enum imp_status imp__props_vector(imp_context *ctx, struct imp_node *node,
                                  const char *name, const double fallback[3],
                                  double out[3])
{
    struct imp_prop *p;
    const enum imp_status st = find(ctx, node, name, IMP_PROP_VECTOR, &p);
    if (st != IMP_OK) return st;
    for (int i = 0; i < 3; i++) {
        const double v = p ? p->number[i] : fallback[i];
        if (!isfinite(v))
            return imp__prop_error(ctx, node, p, IMP_E_SCENE, "%s is not finite", name);
        out[i] = v;
    }
    return IMP_OK;
}

enum imp_status imp__props_transform(imp_context *ctx, struct imp_node *node,
                                     const char *name, double out[16])
{
    struct imp_prop *p;
    const enum imp_status st = find(ctx, node, name, IMP_PROP_TRANSFORM, &p);
    if (st != IMP_OK) return st;
    for (int i = 0; i < 16; i++) out[i] = p ? p->number[i] : i % 5 == 0;
    return IMP_OK;
}

bool imp__props_has(struct imp_node *node, const char *name)
{
    imp__node_ask(node, name);
    return imp__node_prop(node, name) || imp__node_child(node, name);
}

enum imp_status imp__props_choice(imp_context *ctx, struct imp_node *node,
                                  const char *name, const char *const *words, int n,
                                  int fallback, int *out)
{
    struct imp_prop *p;
    const enum imp_status st = find(ctx, node, name, IMP_PROP_STRING, &p);
    if (st != IMP_OK) return st;
    if (!p) {
        *out = fallback;
        return IMP_OK;
    }
    char list[256] = "";
    for (int i = 0; i < n; i++) {
        if (strcasecmp(words[i], p->string) == 0) {
            *out = i;
            return IMP_OK;
        }
        const size_t used = strlen(list);
        snprintf(list + used, sizeof list - used, "%s%s", i ? ", " : "", words[i]);
    }
    return imp__prop_error(ctx, node, p, IMP_E_SCENE, "%s = '%s': must be one of %s",
                           name, p->string, list);
}

/* Defaults that a kind added have the node's own location. */
static bool is_written(const struct imp_node *node, const char *name)
{
    const struct imp_prop *p = imp__node_prop(node, name);
    return p && (p->loc.line != node->loc.line || p->loc.column != node->loc.column);
}

const char *imp__node_meant(const struct imp_node *node, const char *name)
{
    struct imp_nearest near = imp__nearest(name);
    for (int k = 0; k < node->n_asked; k++) {
        struct imp_nearest closer = near;
        imp__nearest_try(&closer, node->asked[k]);
        if (closer.distance < near.distance && !is_written(node, node->asked[k]) &&
            !imp__node_child(node, node->asked[k]))
            near = closer;
    }
    return near.best;
}

enum imp_status imp__props_finish(imp_context *ctx, const struct imp_node *node)
{
    char list[768] = "", where[256], meant[80] = "";
    const struct imp_prop *first = NULL;
    /* The message has room for some: how many there are may not count. */
    for (size_t i = 0; i < node->n_props && strlen(list) + 1 < sizeof list; i++) {
        const struct imp_prop *p = &node->props[i];
        if (p->used) continue;
        const size_t n = strlen(list);
        const char *near = imp__node_meant(node, p->name);
        if (near && !*meant)
            snprintf(meant, sizeof meant, "; did you mean '%.50s'?", near);
        if (first) {
            snprintf(list + n, sizeof list - n, ", '%s' (%s)", p->name,
                     imp__loc_text(p->loc, where, sizeof where));
            continue;
        }
        first = p; /* whose place the message begins with */
        snprintf(list, sizeof list, "'%s'", p->name);
    }
    for (size_t i = 0; i < node->n_children && strlen(list) + 1 < sizeof list; i++) {
        const struct imp_child *c = &node->children[i];
        if (c->used) continue;
        const size_t n = strlen(list);
        const char *near = c->name ? imp__node_meant(node, c->name) : NULL;
        if (near && !*meant)
            snprintf(meant, sizeof meant, "; did you mean '%.50s'?", near);
        snprintf(list + n, sizeof list - n, "%s%s '%s' (%s)", n ? ", " : "",
                 c->node ? c->node->tag : "ref", c->name ? c->name : "",
                 imp__loc_text(c->loc, where, sizeof where));
    }
    if (!*list) return IMP_OK;
    if (node->lenient) { /* format/survey.c lists it */
        ((struct imp_node *)node)->read = true;
        return IMP_OK;
    }
    return imp__prop_error(ctx, node, first, IMP_E_SCENE,
                           "not a property of this plugin: %s%s", list, meant);
}
