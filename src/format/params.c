/* SPDX-License-Identifier: Apache-2.0
 *
 * Definition and expansion of $name in scene files, with limits on what nested
 * defaults may expand to. */
#include "params.h"
#include "base/nearest.h"
#include <string.h>

/* A parameter made of two others doubles with every <default>: bound what may come of it.
 */
#define PARAMS_MAX      4096
#define VALUE_BYTES_MAX ((size_t)16 << 20)
#define TOTAL_BYTES_MAX ((size_t)256 << 20)

static enum imp_status no_memory(imp_context *ctx)
{
    return imp__error(ctx, IMP_E_NOMEM, "parameters: out of memory");
}

static struct imp_variable *find(const struct imp_params *p, const char *name,
                                 size_t length)
{
    for (size_t i = 0; i < p->n; i++)
        if (p->at[i].length == length && memcmp(p->at[i].name, name, length) == 0)
            return &p->at[i];
    return NULL;
}

static enum imp_status add(struct imp_params *p, const char *name, size_t length,
                           const char *value, bool given)
{
    if (p->n >= PARAMS_MAX)
        return imp__error(p->ctx, IMP_E_SCENE, "more than %d parameters", PARAMS_MAX);
    struct imp_variable *at =
        imp__grow(p->ctx, p->at, &p->capacity, p->n + 1, sizeof *at);
    if (!at) return no_memory(p->ctx);
    p->at = at;
    char *name_copy = imp__arena_array(&p->arena, length + 1, 1);
    char *value_copy = imp__arena_strdup(&p->arena, value);
    if (!name_copy || !value_copy) return no_memory(p->ctx);
    memcpy(name_copy, name, length);
    size_t i = p->n++;
    for (; i > 0 && at[i - 1].length < length; i--) at[i] = at[i - 1];
    at[i] = (struct imp_variable){
        .name = name_copy, .value = value_copy, .length = length, .given = given};
    return IMP_OK;
}

enum imp_status imp__params_init(struct imp_params *p, imp_context *ctx,
                                 const char *const *defines, size_t n)
{
    *p = (struct imp_params){.ctx = ctx};
    imp__arena_init(&p->arena, ctx);
    for (size_t i = 0; i < n; i++) {
        const char *equals = defines && defines[i] ? strchr(defines[i], '=') : NULL;
        if (!equals || equals == defines[i])
            return imp__error(ctx, IMP_E_ARG, "definition '%s' is not name=value",
                              defines && defines[i] ? defines[i] : "");
        const size_t length = (size_t)(equals - defines[i]);
        struct imp_variable *old = find(p, defines[i], length);
        if (old) {
            old->value = imp__arena_strdup(&p->arena, equals + 1);
            if (!old->value) return no_memory(ctx);
            continue;
        }
        const enum imp_status st = add(p, defines[i], length, equals + 1, true);
        if (st != IMP_OK) return st;
    }
    return IMP_OK;
}

void imp__params_free(struct imp_params *p)
{
    if (!p->ctx) return;
    imp__release(p->ctx, p->at);
    imp__arena_free(&p->arena);
    p->at = NULL;
}

enum imp_status imp__params_default(struct imp_params *p, const char *name,
                                    const char *value)
{
    /* The first one counts: a file sets the defaults of what it includes. */
    if (find(p, name, strlen(name))) return IMP_OK;
    return add(p, name, strlen(name), value, false);
}

enum imp_status imp__params_assume(struct imp_params *p, const char *name,
                                   const char *value)
{
    if (find(p, name, strlen(name))) return IMP_OK;
    const enum imp_status st = add(p, name, strlen(name), value, false);
    if (st == IMP_OK) find(p, name, strlen(name))->assumed = true;
    return st;
}

bool imp__params_assumed(const struct imp_params *p, const char *name)
{
    const struct imp_variable *v = find(p, name, strlen(name));
    return v && v->assumed;
}

static struct imp_variable *match(struct imp_params *p, const char *text)
{
    for (size_t i = 0; i < p->n; i++)
        if (strncmp(p->at[i].name, text, p->at[i].length) == 0) return &p->at[i];
    return NULL;
}

/* One walk over `text`, writing to `to` unless it is NULL; *length is what it makes. */
static enum imp_status expand(struct imp_params *p, const char *text, char *to,
                              size_t *length)
{
    size_t n = 0;
    for (const char *s = text; *s;) {
        if (s[0] == '\\' && s[1] == '$') {
            if (to) to[n] = '$';
            n++, s += 2;
            continue;
        }
        if (*s != '$') {
            if (to) to[n] = *s;
            n++, s++;
            continue;
        }
        struct imp_variable *v = match(p, s + 1);
        if (!v) {
            size_t word = 1;
            while (word < 80 && s[word] && !strchr(" \t\r\n,;:/$\"'<>", s[word])) word++;
            return imp__error(p->ctx, IMP_E_SCENE,
                              "parameter '%.*s' has no value (<default> or -D)",
                              (int)word, s);
        }
        v->used = true;
        const size_t value = strlen(v->value);
        if (to) memcpy(to + n, v->value, value);
        n += value, s += 1 + v->length;
        if (n > VALUE_BYTES_MAX)
            return imp__error(p->ctx, IMP_E_SCENE, "value is too long");
    }
    *length = n;
    return IMP_OK;
}

enum imp_status imp__params_expand(struct imp_params *p, struct imp_arena *scratch,
                                   const char *text, const char **out)
{
    if (!strchr(text, '$')) {
        *out = text;
        return IMP_OK;
    }
    size_t n;
    enum imp_status st = expand(p, text, NULL, &n);
    if (st != IMP_OK) return st;
    p->expanded += n;
    if (p->expanded > TOTAL_BYTES_MAX)
        return imp__error(p->ctx, IMP_E_SCENE, "parameters grow beyond all bounds");
    char *copy = imp__arena_array(scratch, n + 1, 1);
    if (!copy) return no_memory(p->ctx);
    st = expand(p, text, copy, &n);
    if (st == IMP_OK) *out = copy;
    return st;
}

const char *imp__params_unused(const struct imp_params *p, const char **meant)
{
    for (size_t i = 0; i < p->n; i++) {
        if (!p->at[i].given || p->at[i].used) continue;
        struct imp_nearest near = imp__nearest(p->at[i].name);
        for (size_t k = 0; k < p->n; k++)
            if (!p->at[k].given) imp__nearest_try(&near, p->at[k].name);
        *meant = near.best;
        return p->at[i].name;
    }
    return NULL;
}
