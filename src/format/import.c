/* SPDX-License-Identifier: Apache-2.0
 *
 * What the readers of other programs' files have in common. */
#include "import.h"
#include "load.h"
#include "search.h"
#include "value.h"
#include <stdio.h>
#include <string.h>
#include <strings.h>

static const struct {
    const char *ending;
    imp__import_read *read;
} readers[] = {{".rad", imp__rad_read},      {".vf", imp__view_read},
               {".obj", imp__obj_read},      {".gltf", imp__gltf_read},
               {".glb", imp__gltf_read},     {".ldt", imp__luminaire_read},
               {".ies", imp__luminaire_read}};

imp__import_read *imp__import_of(const char *name)
{
    const size_t n = strlen(name);
    for (size_t i = 0; i < imp_count(readers); i++) {
        const size_t length = strlen(readers[i].ending);
        if (n > length && strcasecmp(name + n - length, readers[i].ending) == 0)
            return readers[i].read;
    }
    return NULL;
}

/* ---- A scene of one file --------------------------------------------------------- */

/* The text that a parameter has, or `missing`; in scratch. */
static enum imp_status parameter(const struct imp__import *in, const char *name,
                                 const char *missing, const char **out)
{
    enum imp_status st = IMP_OK;
    char dollar[40];
    snprintf(dollar, sizeof dollar, "$%s", name);
    IMP_TRY(imp__params_assume(in->params, name, missing));
    IMP_TRY(imp__params_expand(in->params, in->scratch, dollar, out));
out:
    return st;
}

enum imp_status imp__import_number(const struct imp__import *in, const char *name,
                                   const char *missing, double lo, double hi, double *out)
{
    const char *text;
    const enum imp_status st = parameter(in, name, missing, &text);
    if (st != IMP_OK) return st;
    if (!imp__value_float(text, out) || !(*out >= lo && *out <= hi))
        return imp__error(in->scene->ctx, IMP_E_SCENE,
                          "%s: parameter %s = '%.80s' is not between %g and %g", in->name,
                          name, text, lo, hi);
    return IMP_OK;
}

static enum imp_status view_add(const struct imp__import *in)
{
    static char plain[] = "rvu";
    enum imp_status st = IMP_OK;
    const char *name;
    struct imp_bytes text = {0}, none = {(unsigned char *)plain, 3, 3};
    struct imp__import view = *in;
    IMP_TRY(parameter(in, "view", "", &name));
    view.text = &none;
    if (*name) {
        IMP_TRY(imp__search(in->scene, NULL, name, &view.name));
        IMP_TRY(imp__file_read(in->scene->ctx, view.name, 1 << 20, &text));
        view.text = &text;
    }
    IMP_TRY(imp__view_read(&view));
out:
    imp__bytes_free(in->scene->ctx, &text);
    return st;
}

enum imp_status imp__import_scene(const struct imp__import *in)
{
    enum imp_status st = IMP_OK;
    const struct imp_loc loc = {in->name, 1, 1};
    struct imp__import inside = *in;
    struct imp_node *integrator;
    inside.alone = true;
    imp__import_read *read = imp__import_of(in->name);
    IMP_TRY(
        imp__tree_open(in->tree, NULL, "scene", NULL, NULL, NULL, loc, &inside.parent));
    IMP_TRY(imp__tree_open(in->tree, inside.parent, "integrator", "path", NULL, NULL, loc,
                           &integrator));
    IMP_TRY(read(&inside));
    if (read == imp__rad_read) IMP_TRY(view_add(&inside));
out:
    return st;
}

/* ---- Properties ------------------------------------------------------------------ */

static enum imp_status numbers(const struct imp__import *in, struct imp_node *node,
                               const char *name, enum imp_prop_type type,
                               const double *value, size_t n, struct imp_loc loc)
{
    struct imp_prop *p;
    const enum imp_status st = imp__tree_prop(in->tree, node, name, type, loc, &p);
    if (st == IMP_OK) memcpy(p->number, value, n * sizeof *value);
    return st;
}

enum imp_status imp__import_float(const struct imp__import *in, struct imp_node *node,
                                  const char *name, double value, struct imp_loc loc)
{
    return numbers(in, node, name, IMP_PROP_FLOAT, &value, 1, loc);
}

enum imp_status imp__import_rgb(const struct imp__import *in, struct imp_node *node,
                                const char *name, const double value[3],
                                struct imp_loc loc)
{
    return numbers(in, node, name, IMP_PROP_RGB, value, 3, loc);
}

enum imp_status imp__import_point(const struct imp__import *in, struct imp_node *node,
                                  const char *name, const double value[3],
                                  struct imp_loc loc)
{
    return numbers(in, node, name, IMP_PROP_VECTOR, value, 3, loc);
}

enum imp_status imp__import_matrix(const struct imp__import *in, struct imp_node *node,
                                   const char *name, const double value[16],
                                   struct imp_loc loc)
{
    return numbers(in, node, name, IMP_PROP_TRANSFORM, value, 16, loc);
}

enum imp_status imp__import_integer(const struct imp__import *in, struct imp_node *node,
                                    const char *name, int64_t value, struct imp_loc loc)
{
    struct imp_prop *p;
    const enum imp_status st =
        imp__tree_prop(in->tree, node, name, IMP_PROP_INTEGER, loc, &p);
    if (st == IMP_OK) p->integer = value;
    return st;
}

enum imp_status imp__import_bool(const struct imp__import *in, struct imp_node *node,
                                 const char *name, bool value, struct imp_loc loc)
{
    struct imp_prop *p;
    const enum imp_status st =
        imp__tree_prop(in->tree, node, name, IMP_PROP_BOOL, loc, &p);
    if (st == IMP_OK) p->integer = value;
    return st;
}

enum imp_status imp__import_string(const struct imp__import *in, struct imp_node *node,
                                   const char *name, const char *value,
                                   struct imp_loc loc)
{
    struct imp_prop *p;
    const enum imp_status st =
        imp__tree_prop(in->tree, node, name, IMP_PROP_STRING, loc, &p);
    if (st != IMP_OK) return st;
    p->string = imp__arena_strdup(&in->scene->arena, value);
    return p->string ? IMP_OK
                     : imp__error(in->scene->ctx, IMP_E_NOMEM, "scene: out of memory");
}

const char *imp__import_id(const struct imp__import *in, const char *wanted)
{
    char text[300];
    snprintf(text, sizeof text, "%s", wanted);
    for (int k = 2; imp__names_find(&in->tree->ids, NULL, text) && k < 1 << 20; k++)
        snprintf(text, sizeof text, "%.280s_%d", wanted, k);
    return imp__arena_strdup(&in->scene->arena, text);
}

const char *imp__import_name(const struct imp__import *in, const char *name)
{
    char text[128];
    snprintf(text, sizeof text, "%.100s", name);
    for (char *c = text; *c; c++)
        if (strchr(".*?[] \t\r\n=,:/\\\"'<>&", *c) || (unsigned char)*c < ' ') *c = '_';
    return imp__import_id(in, text);
}

/* ---- What is not read ------------------------------------------------------------ */

enum imp_status imp__unread_add(const struct imp__import *in, struct imp__unread *u,
                                int line, const char *what, const char *lost)
{
    char text[1024];
    u->n++;
    if (in->scene->lenient) {
        snprintf(text, sizeof text, "%s:%d:1: %s: not supported; %s", in->name, line,
                 what, lost);
        return imp__lost_add(in->scene, text);
    }
    if (u->listed < u->n - 1) return IMP_OK; /* one before had no room */
    const size_t used = strlen(u->text);
    const int n = u->n == 1
                      ? snprintf(text, sizeof text, "%s:%d:1: %s", in->name, line, what)
                      : snprintf(text, sizeof text, ", %s (line %d)", what, line);
    if (n < 0 || used + (size_t)n + 1 > sizeof u->text) return IMP_OK;
    memcpy(u->text + used, text, (size_t)n + 1);
    u->listed = u->n;
    return IMP_OK;
}

enum imp_status imp__unread_finish(const struct imp__import *in,
                                   const struct imp__unread *u)
{
    char more[40] = "";
    if (!u->n || in->scene->lenient) return IMP_OK;
    if (u->listed < u->n) snprintf(more, sizeof more, " and %d more", u->n - u->listed);
    return imp__error(in->scene->ctx, IMP_E_UNSUPPORTED,
                      "%s%s: not supported (--lenient goes on without)", u->text, more);
}
