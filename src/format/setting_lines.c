/* SPDX-License-Identifier: Apache-2.0
 *
 * Values of parameters as text (setting_lines.h): lines NAME=V[,V..], empty lines, and lines that
 * begin with #. */
#include "setting_lines.h"
#include "base/arguments.h"
#include "value.h"
#include <stdio.h>
#include <string.h>

/* Whom a message speaks of. */
struct source {
    const char *name; /* NULL: a text of the caller's alone */
    size_t line;      /* 0: it has one */
    bool
        quotes; /* may messages repeat it? Not what a scene file names: that may be anything */
};

static enum imp_status placed(imp_context *ctx, enum imp_status st,
                              const struct source *from)
{
    if (st == IMP_OK || !from->name) return st;
    if (!from->line) return imp__error_prefix(ctx, st, "%s", from->name);
    return imp__error_prefix(ctx, st, "%s:%zu", from->name, from->line);
}

/* An object that has to become a parameter first: NAME.pose and the like. What is wrong with
 * a name that parameters of other kinds may have is said where it is looked for. */
static enum imp_status geometry_add(struct imp_scene *scene, const char *name)
{
    const char *dot = strrchr(name, '.');
    size_t index;
    if (imp_scene_find_param(scene, name, &index) == IMP_OK) return IMP_OK;
    const enum imp_status st = imp_scene_add_geometry(scene, name);
    return st == IMP_E_ARG && !(dot && !strcmp(dot, ".pose")) ? IMP_OK : st;
}

/* "V,V,..", a zero byte behind it. values [1 + commas]. */
static enum imp_status values_read(imp_context *ctx, char *text,
                                   const struct source *from, double *values, size_t *n)
{
    *n = 0;
    for (char *next = text; next;) {
        char *item = next;
        next = strchr(item, ',');
        if (next) *next++ = 0;
        if (imp__value_float(item, &values[(*n)++])) continue;
        if (!from->quotes)
            return imp__error(ctx, IMP_E_ARG, "expected ID=VALUE[,VALUE..]");
        return imp__error(ctx, IMP_E_ARG, "'%.60s' is not a number", item);
    }
    return IMP_OK;
}

/* One setting, a zero byte behind it; written to. */
static enum imp_status line_apply(struct imp_scene *scene, char *line,
                                  const struct source *from)
{
    imp_context *ctx = scene->ctx;
    char *equal = strchr(line, '=');
    size_t index, n = 1;
    if (!equal || equal == line)
        return from->quotes && from->name
                   ? imp__error(ctx, IMP_E_ARG, "'%.60s': expected ID=VALUE", line)
                   : imp__error(ctx, IMP_E_ARG, "expected ID=VALUE");
    *equal++ = 0;
    for (const char *c = equal; *c; c++) n += *c == ',';
    double *values = imp__alloc(ctx, n, sizeof *values);
    if (!values) return imp__error(ctx, IMP_E_NOMEM, "no memory for %zu values", n);
    enum imp_status st = values_read(ctx, equal, from, values, &n);
    if (st == IMP_OK) st = geometry_add(scene, line);
    if (st == IMP_OK) st = imp_scene_find_param(scene, line, &index);
    if (st == IMP_OK) st = imp_scene_set_values(scene, index, n, values);
    imp__release(ctx, values);
    return st;
}

/* text [length + 1], written to. */
static enum imp_status lines_apply(struct imp_scene *scene, char *text, size_t length,
                                   struct source from)
{
    const bool numbered = from.name && from.line;
    for (char *line = text, *next; line < text + length; line = next) {
        char *end = memchr(line, '\n', (size_t)(text + length - line));
        if (!end) end = text + length;
        next = end + 1;
        if (end > line && end[-1] == '\r') end--;
        *end = 0;
        enum imp_status st = IMP_OK;
        if (strlen(line) != (size_t)(end - line))
            st = imp__error(scene->ctx, IMP_E_ARG,
                            "a zero byte: this is no list of settings");
        else if (*line && *line != '#') st = line_apply(scene, line, &from);
        if (st != IMP_OK) return placed(scene->ctx, st, &from);
        from.line += numbered;
    }
    return IMP_OK;
}

static enum imp_status text_apply(struct imp_scene *scene, const char *text,
                                  size_t length, struct source from)
{
    char *own = imp__alloc_raw(scene->ctx, length + 1, 1);
    if (!own)
        return imp__error(scene->ctx, IMP_E_NOMEM, "no memory for settings of %zu bytes",
                          length);
    memcpy(own, text, length);
    own[length] = 0;
    const enum imp_status st = lines_apply(scene, own, length, from);
    imp__release(scene->ctx, own);
    return st;
}

enum imp_status imp__settings_apply(struct imp_scene *scene,
                                    const struct imp_setting *settings)
{
    for (const struct imp_setting *s = settings; s; s = s->next)
        IMP_CHECKED(text_apply(scene, s->text, s->length,
                               (struct source){.name = s->place,
                                               .line = !s->in_scene,
                                               .quotes = s->in_scene}));
    return IMP_OK;
}

enum imp_status imp_scene_set_text(imp_scene *scene, const char *text, size_t length,
                                   const char *name)
{
    IMP_REQUIRE(NULL, scene, "scene");
    IMP_REQUIRE(scene->ctx, text, "text");
    IMP_FLOAT_MODE;
    if (!scene->committed)
        return imp__error(scene->ctx, IMP_E_ARG,
                          "imp_scene_set_text: the scene is not committed");
    return text_apply(scene, text, length,
                      (struct source){.name = name, .line = 1, .quotes = true});
}
