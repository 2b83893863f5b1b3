/* SPDX-License-Identifier: Apache-2.0
 *
 * MTL files: the materials of OBJ files (obj_parts.h), and bsdfs made of them. */
#include "base/arguments.h"
#include "base/number.h"
#include "obj_parts.h"
#include "search.h"
#include <math.h>
#include <stdio.h>
#include <string.h>
#include <strings.h>

struct line {
    const struct imp__import *in;
    const char *file, *s, *end;
    int number;
};

static enum imp_status IMP_PRINTF(2, 3)
    line_error(const struct line *l, const char *format, ...)
{
    char text[256];
    va_list args;
    va_start(args, format);
    vsnprintf(text, sizeof text, format, args);
    va_end(args);
    return imp__loc_error(l->in->scene->ctx, (struct imp_loc){l->file, l->number, 1},
                          IMP_E_SCENE, "%s", text);
}

static bool blank(char c) { return c == ' ' || c == '\t' || c == '\r'; }

/* The next word; *n 0: the line has ended. */
static const char *word(struct line *l, size_t *n)
{
    while (l->s < l->end && blank(*l->s)) l->s++;
    const char *from = l->s;
    while (l->s < l->end && !blank(*l->s)) l->s++;
    *n = (size_t)(l->s - from);
    return from;
}

static const char *copy(const struct line *l, const char *s, size_t n)
{
    char *text = imp__arena_take(&l->in->scene->files, n + 1, 1);
    if (!text) return NULL;
    memcpy(text, s, n);
    text[n] = 0;
    return text;
}

/* n numbers; of a colour one stands for three. */
static enum imp_status numbers(struct line *l, const char *what, int n, double *out)
{
    for (int i = 0; i < n; i++) {
        size_t length;
        const char *w = word(l, &length), *at = w;
        if (!length && i == 1) {
            out[1] = out[2] = out[0];
            return IMP_OK;
        }
        if (!length || !imp__number(&at, w + length, &out[i]) || at != w + length ||
            !isfinite(out[i]) || out[i] < 0)
            return line_error(l, "%s needs %d number%s, positive or 0", what, n,
                              n > 1 ? "s" : "");
    }
    return IMP_OK;
}

/* The file of a map: the last word, behind the options that begin with '-'. */
static enum imp_status map(struct line *l, const char **out)
{
    size_t n;
    const char *w = word(l, &n), *rest = w;
    if (!n) return line_error(l, "a map without a file");
    if (*w == '-') { /* "-bm 1.0 file.png": names without spaces */
        imp__warn(l->in->scene->ctx, "%s:%d:1: options of a map (%.*s ...) are not read",
                  l->file, l->number, (int)imp_min(n, (size_t)20), w);
        for (size_t m; w = word(l, &m), m;) rest = w, n = m;
        if (*rest == '-') return line_error(l, "a map without a file");
        *out = copy(l, rest, n);
    } else {
        const char *end = l->end;
        while (end > w && blank(end[-1])) end--;
        *out = copy(l, w, (size_t)(end - w));
    }
    if (!*out)
        return imp__error(l->in->scene->ctx, IMP_E_NOMEM, "%s: out of memory", l->file);
    for (char *c = (char *)*out; *c; c++) /* as Windows writes folders */
        if (*c == '\\') *c = '/';
    return IMP_OK;
}

static enum imp_status named(struct line *l, struct imp__mtl_list *list)
{
    imp_context *ctx = l->in->scene->ctx;
    size_t n;
    const char *w = word(l, &n), *end = l->end;
    while (end > w && blank(end[-1])) end--;
    if (!n) return line_error(l, "newmtl without a name");
    struct imp__mtl *grown =
        imp__grow(ctx, list->material, &list->capacity, list->n + 1, sizeof *grown);
    if (!grown) return imp__error(ctx, IMP_E_NOMEM, "%s: out of memory", l->file);
    list->material = grown;
    struct imp__mtl *m = &list->material[list->n];
    *m = (struct imp__mtl){.line = l->number,
                           .library = l->file,
                           .kd = {.8, .8, .8},
                           .ns = 0,
                           .ni = 1.5,
                           .d = 1,
                           .pr = NAN,
                           .pm = NAN,
                           .illum = 2};
    m->name = copy(l, w, (size_t)(end - w));
    if (!m->name) return imp__error(ctx, IMP_E_NOMEM, "%s: out of memory", l->file);
    list->n++;
    return IMP_OK;
}

static enum imp_status statement(struct line *l, struct imp__mtl_list *list)
{
    size_t n;
    const char *w = word(l, &n);
    char key[24];
    double v[3];
    if (!n || *w == '#') return IMP_OK;
    snprintf(key, sizeof key, "%.*s", (int)imp_min(n, sizeof key - 1), w);
    if (strcmp(key, "newmtl") == 0) return named(l, list);
    if (!list->n) return line_error(l, "'%s' before the first newmtl", key);
    struct imp__mtl *m = &list->material[list->n - 1];
    const struct {
        const char *key;
        double *to;
        int n;
    } values[] = {{"Kd", m->kd, 3},  {"Ks", m->ks, 3},  {"Ke", m->ke, 3},
                  {"Ns", &m->ns, 1}, {"Ni", &m->ni, 1}, {"d", &m->d, 1},
                  {"Pr", &m->pr, 1}, {"Pm", &m->pm, 1}};
    const struct {
        const char *key, **to;
    } maps[] = {{"map_Kd", &m->map_kd},     {"map_d", &m->map_d},
                {"map_Bump", &m->map_bump}, {"map_bump", &m->map_bump},
                {"bump", &m->map_bump},     {"map_Pr", &m->map_pr}};
    static const char *const ignored[] = {"Ka", "Tf", "map_Ka", "map_Ns", "sharpness"};
    for (size_t i = 0; i < imp_count(values); i++)
        if (strcmp(key, values[i].key) == 0) {
            /* "Kd spectral file", "d -halo .5": other forms of a value */
            return numbers(l, key, values[i].n, values[i].to);
        }
    for (size_t i = 0; i < imp_count(maps); i++)
        if (strcmp(key, maps[i].key) == 0) return map(l, maps[i].to);
    for (size_t i = 0; i < imp_count(ignored); i++)
        if (strcmp(key, ignored[i]) == 0) return IMP_OK;
    if (strcmp(key, "Tr") == 0) {
        IMP_CHECKED(numbers(l, key, 1, v));
        m->d = 1 - v[0];
        return IMP_OK;
    }
    if (strcmp(key, "illum") == 0) {
        IMP_CHECKED(numbers(l, key, 1, v));
        m->illum = (int)fmin(v[0], 100);
        return IMP_OK;
    }
    imp__warn(l->in->scene->ctx, "%s:%d:1: %s: not read", l->file, l->number, key);
    return IMP_OK;
}

enum imp_status imp__mtl_parse(const struct imp__import *in, const char *name,
                               const struct imp_bytes *text, struct imp__mtl_list *list)
{
    struct line l = {.in = in, .file = name};
    const char *s = (const char *)text->data, *end = s + text->size;
    while (s < end) {
        const char *stop = memchr(s, '\n', (size_t)(end - s));
        if (!stop) stop = end;
        l.number++;
        l.s = s;
        l.end = stop;
        IMP_CHECKED(statement(&l, list));
        s = stop + 1;
    }
    for (size_t i = 0; i < list->n; i++) {
        const struct imp__mtl *m = &list->material[i];
        l.number = m->line;
        for (int k = 0; k < 3; k++)
            if (m->kd[k] > 1 || m->ks[k] > 1)
                return line_error(&l, "material '%.80s' reflects more than all", m->name);
        if (!(m->d <= 1) || m->d < 0 || m->pr > 1 || m->pm > 1)
            return line_error(&l, "material '%.80s': d, Tr, Pr and Pm are in [0, 1]",
                              m->name);
    }
    return IMP_OK;
}

/* ---- Bsdfs ----------------------------------------------------------------------------- */

struct making {
    const struct imp__import *in;
    const struct imp__mtl *m;
    struct imp_loc loc;
    struct imp_node *at;
    const char *id;
};

static enum imp_status open(struct making *k, const char *type)
{
    const enum imp_status st =
        imp__tree_open(k->in->tree, k->at, "bsdf", type, k->id, NULL, k->loc, &k->at);
    k->id = NULL; /* the outermost has it */
    return st;
}

/* A picture in a slot; its file is beside the library. */
static enum imp_status picture(const struct making *k, const char *slot, const char *file,
                               bool raw)
{
    struct imp_scene *scene = k->in->scene;
    struct imp_node *node;
    const char *folder = imp__folder_of(scene, k->m->library), *path;
    if (!folder)
        return imp__error(scene->ctx, IMP_E_NOMEM, "%s: out of memory", k->in->name);
    IMP_CHECKED(imp__search(scene, folder, file, &path));
    IMP_CHECKED(imp__tree_open(k->in->tree, k->at, "texture", "bitmap", NULL, slot,
                               k->loc, &node));
    if (raw) IMP_CHECKED(imp__import_bool(k->in, node, "raw", true, k->loc));
    return imp__import_string(k->in, node, "filename", path, k->loc);
}

static enum imp_status color(const struct making *k, const char *slot)
{
    if (k->m->map_kd) return picture(k, slot, k->m->map_kd, false);
    return imp__import_rgb(k->in, k->at, slot, k->m->kd, k->loc);
}

static bool any(const double v[3]) { return v[0] > 0 || v[1] > 0 || v[2] > 0; }

/* Roughness of the microfacets whose lobe is as wide as that of a Phong exponent. */
static double roughness(const struct imp__mtl *m)
{
    return isnan(m->pr) ? sqrt(sqrt(2 / (m->ns + 2))) : m->pr;
}

/* With Pr or Pm, or a coat over a texture: principled. */
static enum imp_status principled(struct making *k)
{
    IMP_CHECKED(open(k, "principled"));
    IMP_CHECKED(color(k, "base_color"));
    if (k->m->map_pr) IMP_CHECKED(picture(k, "roughness", k->m->map_pr, true));
    else
        IMP_CHECKED(
            imp__import_float(k->in, k->at, "roughness", roughness(k->m), k->loc));
    if (k->m->pm > 0)
        IMP_CHECKED(imp__import_float(k->in, k->at, "metallic", k->m->pm, k->loc));
    return IMP_OK;
}

/* Kd and Ks of one channel may not reflect more than all: then both are made smaller. */
static enum imp_status phong(struct making *k)
{
    double kd[3], ks[3];
    for (int c = 0; c < 3; c++) {
        const double all = fmax(k->m->kd[c] + k->m->ks[c], 1);
        kd[c] = k->m->kd[c] / all;
        ks[c] = k->m->ks[c] / all;
    }
    IMP_CHECKED(open(k, "phong"));
    IMP_CHECKED(imp__import_rgb(k->in, k->at, "diffuse_reflectance", kd, k->loc));
    IMP_CHECKED(imp__import_rgb(k->in, k->at, "specular_reflectance", ks, k->loc));
    return imp__import_float(k->in, k->at, "exponent", k->m->ns, k->loc);
}

enum imp_status imp__mtl_make(const struct imp__import *in, struct imp__mtl *m)
{
    if (m->id) return IMP_OK;
    m->id = imp__import_name(in, m->name);
    if (!m->id)
        return imp__error(in->scene->ctx, IMP_E_NOMEM, "%s: out of memory", in->name);
    struct making k = {in, m, {m->library, m->line, 1}, in->parent, m->id};
    if (m->map_bump) /* heights or normals: the file does not say */
        imp__warn(in->scene->ctx, "%s:%d:1: material '%.80s': its bumps are not read",
                  m->library, m->line, m->name);
    if (any(m->ks) && !(m->ns > 0) && m->illum == 2 && isnan(m->pr) && isnan(m->pm))
        imp__warn(in->scene->ctx, "%s:%d:1: material '%.80s': Ks without Ns is not read",
                  m->library, m->line, m->name);
    if (m->illum > 10)
        imp__warn(in->scene->ctx, "%s:%d:1: material '%.80s': illum %d is not known",
                  m->library, m->line, m->name, m->illum);
    const bool glass = m->illum == 4 || m->illum == 6 || m->illum == 7 || m->illum == 9,
               mirror = m->illum == 3 || m->illum == 5;
    if (glass && m->ni > 1.0001) {
        IMP_CHECKED(open(&k, "dielectric"));
        IMP_CHECKED(imp__import_float(in, k.at, "int_ior", fmin(m->ni, 10), k.loc));
        return imp__import_float(in, k.at, "ext_ior", 1, k.loc);
    }
    if (m->map_d || m->d < 1) {
        IMP_CHECKED(open(&k, "mask"));
        IMP_CHECKED(m->map_d ? picture(&k, "opacity", m->map_d, true)
                             : imp__import_float(in, k.at, "opacity", m->d, k.loc));
    }
    IMP_CHECKED(open(&k, "twosided"));
    if (!isnan(m->pr) || !isnan(m->pm) || m->map_pr) return principled(&k);
    if (mirror && !any(m->kd)) {
        IMP_CHECKED(open(&k, "conductor"));
        return imp__import_rgb(in, k.at, "specular_reflectance", m->ks, k.loc);
    }
    if (any(m->ks) && m->ns > 0 && m->illum != 1 && m->illum != 0)
        return m->map_kd ? principled(&k) : phong(&k);
    IMP_CHECKED(open(&k, "diffuse"));
    return color(&k, "reflectance");
}
