/* SPDX-License-Identifier: Apache-2.0
 *
 * The grammar: one rule a tag, which attributes it takes and what it does (scene-format 1.1
 * to 1.4). */
#include <stdio.h>
#include <string.h>
#include "search.h"
#include "value.h"
#include "xml.h"

typedef void act_fn(struct xml_file *f, const struct xml_attributes *a);

/* ---- Attributes ------------------------------------------------------------------- */

static const char *get(const struct xml_attributes *a, const char *name)
{
    for (int i = 0; i < a->n; i++)
        if (strcmp(a->at[i].name, name) == 0) return a->at[i].value;
    return NULL;
}

/* Is `name` one of the words of `list`? */
static bool listed(const char *list, const char *name)
{
    const size_t n = strlen(name);
    for (const char *s = list; *s; s += strspn(s, " ")) {
        const size_t length = strcspn(s, " ");
        if (length == n && memcmp(s, name, n) == 0) return true;
        s += length;
    }
    return false;
}

/* Check against the words a tag requires and allows, and replace parameters. */
static bool attributes_read(struct xml_file *f, const char *tag, const char *required,
                            const char *optional, const char **from,
                            struct xml_attributes *to)
{
    to->n = 0;
    for (; *from; from += 2) {
        if (!listed(required, from[0]) && !listed(optional, from[0])) {
            imp__xml_fail(f, IMP_E_SCENE, "<%s> has no attribute '%s' (it has: %s%s%s)", tag,
                          from[0], required, *required && *optional ? " " : "", optional);
            return false;
        }
        const enum imp_status st = imp__params_expand(&f->reader->params, &f->reader->scratch,
                                                      from[1], &to->at[to->n].value);
        if (st != IMP_OK) {
            imp__xml_fail_here(f, st);
            return false;
        }
        to->at[to->n++].name = from[0]; /* at most all listed words: expat refuses repeats */
    }
    for (const char *s = required; *s; s += strspn(s, " ")) {
        char word[32];
        const size_t length = strcspn(s, " ");
        snprintf(word, sizeof word, "%.*s", (int)length, s);
        if (!get(to, word)) {
            imp__xml_fail(f, IMP_E_SCENE, "<%s> needs the attribute '%s'", tag, word);
            return false;
        }
        s += length;
    }
    return true;
}

/* ---- Levels ----------------------------------------------------------------------- */

static struct xml_level *top(struct xml_file *f)
{
    return f->depth ? &f->levels[f->depth - 1] : NULL;
}

static struct xml_level *push(struct xml_file *f, enum xml_level_kind kind, const char *tag)
{
    struct xml_level *l = &f->levels[f->depth++];
    *l = (struct xml_level){.kind = kind, .tag = tag};
    return l;
}

/* The name attribute, upgraded if the file is old; NULL if there is none or f failed. */
static const char *name_of(struct xml_file *f, const struct xml_attributes *a)
{
    const char *name = get(a, "name");
    const struct xml_level *l = top(f);
    if (!name || !f->old) return name;
    name = imp__upgrade_name(&f->reader->scratch, l && l->props ? l->props->type : "", name);
    if (!name) imp__xml_fail(f, IMP_E_NOMEM, "out of memory");
    return name;
}

/* ---- Plain properties --------------------------------------------------------------- */

static struct imp_prop *prop_add(struct xml_file *f, const struct xml_attributes *a,
                                 enum imp_prop_type type)
{
    struct imp_prop *p = NULL;
    const char *name = name_of(f, a);
    if (f->st != IMP_OK) return NULL;
    imp__xml_fail_placed(f, imp__tree_prop(&f->reader->tree, top(f)->props, name, type,
                                           imp__xml_loc(f), &p));
    return p;
}

static void bad_value(struct xml_file *f, const char *tag, const struct xml_attributes *a,
                      const char *what)
{
    imp__xml_fail(f, IMP_E_SCENE, "%s '%s': '%.80s' is not %s", tag, get(a, "name"),
                  get(a, "value"), what);
}

static void act_integer(struct xml_file *f, const struct xml_attributes *a)
{
    int64_t v;
    if (!imp__value_integer(get(a, "value"), &v)) {
        bad_value(f, "integer", a, "an integer");
        return;
    }
    struct imp_prop *p = prop_add(f, a, IMP_PROP_INTEGER);
    if (p) p->integer = v;
}

static void act_float(struct xml_file *f, const struct xml_attributes *a)
{
    double v;
    if (!imp__value_float(get(a, "value"), &v)) {
        bad_value(f, "float", a, "a finite number");
        return;
    }
    struct imp_prop *p = prop_add(f, a, IMP_PROP_FLOAT);
    if (p) p->number[0] = v;
}

static void act_boolean(struct xml_file *f, const struct xml_attributes *a)
{
    bool v;
    if (!imp__value_bool(get(a, "value"), &v)) {
        bad_value(f, "boolean", a, "true or false");
        return;
    }
    struct imp_prop *p = prop_add(f, a, IMP_PROP_BOOL);
    if (p) p->integer = v;
}

static void act_string(struct xml_file *f, const struct xml_attributes *a)
{
    struct imp_prop *p = prop_add(f, a, IMP_PROP_STRING);
    if (!p) return;
    p->string = imp__arena_strdup(&f->reader->scene->arena, get(a, "value"));
    if (!p->string) imp__xml_fail(f, IMP_E_NOMEM, "out of memory");
}

/* x y z with defaults `missing`, or value; false if f failed. */
static bool xyz(struct xml_file *f, const char *tag, const struct xml_attributes *a,
                double missing, double out[3])
{
    static const char *const axis[] = {"x", "y", "z"};
    const char *value = get(a, "value");
    for (int i = 0; i < 3; i++) {
        const char *text = get(a, axis[i]);
        out[i] = missing;
        if (text && value) {
            imp__xml_fail(f, IMP_E_SCENE, "%s: either 'value' or x, y, z, not both", tag);
            return false;
        }
        if (text && !imp__value_float(text, &out[i])) {
            imp__xml_fail(f, IMP_E_SCENE, "%s: %s = '%.80s' is not a finite number", tag,
                          axis[i], text);
            return false;
        }
    }
    if (value && !imp__value_triple(value, out)) {
        imp__xml_fail(f, IMP_E_SCENE, "%s: '%.80s' is not one or three finite numbers", tag,
                      value);
        return false;
    }
    return true;
}

static void act_vector(struct xml_file *f, const struct xml_attributes *a)
{
    double v[3];
    if (!get(a, "value") && !(get(a, "x") && get(a, "y") && get(a, "z"))) {
        imp__xml_fail(f, IMP_E_SCENE, "point or vector '%s': needs x, y and z, or 'value'",
                      get(a, "name"));
        return;
    }
    if (!xyz(f, "point or vector", a, 0, v)) return;
    struct imp_prop *p = prop_add(f, a, IMP_PROP_VECTOR);
    if (p) memcpy(p->number, v, sizeof v);
}

static void act_rgb(struct xml_file *f, const struct xml_attributes *a)
{
    double v[3];
    if (!imp__value_triple(get(a, "value"), v)) {
        bad_value(f, "rgb", a, "one or three finite numbers");
        return;
    }
    struct imp_prop *p = prop_add(f, a, IMP_PROP_RGB);
    if (p) memcpy(p->number, v, sizeof v);
}

static enum imp_status samples_of(struct xml_file *f, const char *value, const char *filename,
                                  struct imp_samples *out)
{
    struct xml_reader *r = f->reader;
    if (value) return imp__samples_parse(r->ctx, value, out);
    const char *path;
    const enum imp_status st =
        imp__search(r->scene, f->includer ? f->folder : NULL, filename, &path);
    return st == IMP_OK ? imp__samples_read(r->ctx, path, out) : st;
}

static void act_spectrum(struct xml_file *f, const struct xml_attributes *a)
{
    const char *value = get(a, "value"), *filename = get(a, "filename");
    if (!value == !filename) {
        imp__xml_fail(f, IMP_E_SCENE, "spectrum '%s': needs either 'value' or 'filename'",
                      get(a, "name"));
        return;
    }
    double constant;
    if (value && !strchr(value, ':')) {
        if (imp__value_list(value, 1, &constant) != 1) {
            bad_value(f, "spectrum", a, "a finite number or a list of wavelength:value");
            return;
        }
        struct imp_prop *p = prop_add(f, a, IMP_PROP_UNIFORM);
        if (p) p->number[0] = constant;
        return;
    }
    struct imp_samples s = {0};
    const enum imp_status st = samples_of(f, value, filename, &s);
    if (st != IMP_OK) {
        imp__error_prefix(f->reader->ctx, st, "spectrum '%s'", get(a, "name"));
        imp__xml_fail_here(f, st);
        return;
    }
    struct imp_prop *p = prop_add(f, a, IMP_PROP_SPECTRUM);
    double *list = p ? imp__arena_array(&f->reader->scene->arena, 2 * s.n, sizeof *list) : NULL;
    if (list) {
        memcpy(list, s.list, 2 * s.n * sizeof *list);
        p->list = list;
        p->n = s.n;
    } else
        imp__xml_fail(f, IMP_E_NOMEM, "out of memory");
    imp__release(f->reader->ctx, s.list);
}

/* ---- References, parameters, files --------------------------------------------------- */

static void act_ref(struct xml_file *f, const struct xml_attributes *a)
{
    const char *name = name_of(f, a);
    if (f->st != IMP_OK) return;
    imp__xml_fail_placed(f, imp__tree_ref(&f->reader->tree, top(f)->node, get(a, "id"), name,
                                          imp__xml_loc(f)));
}

static void act_alias(struct xml_file *f, const struct xml_attributes *a)
{
    imp__xml_fail_placed(f, imp__tree_alias(&f->reader->tree, get(a, "id"), get(a, "as"),
                                            imp__xml_loc(f)));
}

static void act_default(struct xml_file *f, const struct xml_attributes *a)
{
    const char *name = get(a, "name");
    if (!*name) {
        imp__xml_fail(f, IMP_E_SCENE, "default: empty name");
        return;
    }
    const enum imp_status st =
        imp__params_default(&f->reader->params, name, get(a, "value"));
    if (st != IMP_OK) imp__xml_fail_here(f, st);
}

static void act_include(struct xml_file *f, const struct xml_attributes *a)
{
    const char *name = name_of(f, a);
    if (f->st == IMP_OK) imp__xml_include(f, get(a, "filename"), name, top(f)->node);
}

static void act_path(struct xml_file *f, const struct xml_attributes *a)
{
    if (f->depth != 1) {
        imp__xml_fail(f, IMP_E_SCENE, "<path> may only stand in the root of a file");
        return;
    }
    const char *folder;
    enum imp_status st =
        imp__search(f->reader->scene, f->folder, get(a, "value"), &folder);
    if (st == IMP_OK) st = imp__search_push(f->reader->scene, folder);
    if (st != IMP_OK) imp__xml_fail_here(f, st);
}

/* ---- Transforms: every operation multiplies from the left ------------------------------ */

static void apply(struct xml_file *f, struct imp_mat4 op)
{
    struct xml_level *l = top(f);
    l->matrix = imp__mat4_multiply(&op, &l->matrix);
    if (!imp__mat4_is_finite(&l->matrix))
        imp__xml_fail(f, IMP_E_SCENE, "the transform is not finite");
}

static void act_translate(struct xml_file *f, const struct xml_attributes *a)
{
    double v[3];
    if (xyz(f, "translate", a, 0, v)) apply(f, imp__translate(imp__v3(v[0], v[1], v[2])));
}

static void act_scale(struct xml_file *f, const struct xml_attributes *a)
{
    double v[3];
    if (xyz(f, "scale", a, 1, v)) apply(f, imp__scale(imp__v3(v[0], v[1], v[2])));
}

static void act_rotate(struct xml_file *f, const struct xml_attributes *a)
{
    double v[3], angle;
    if (!imp__value_float(get(a, "angle"), &angle)) {
        imp__xml_fail(f, IMP_E_SCENE, "rotate: angle = '%.80s' is not a finite number",
                      get(a, "angle"));
        return;
    }
    if (!xyz(f, "rotate", a, 0, v)) return;
    const imp_v3 axis = imp__v3(v[0], v[1], v[2]);
    const double length = imp__length(axis);
    if (!(length > 0) || !isfinite(length)) {
        imp__xml_fail(f, IMP_E_SCENE, "rotate: the axis is %s",
                      length > 0 ? "too long" : "zero");
        return;
    }
    if (fabs(length - 1) > 1e-6) {
        char where[512];
        imp__warn(f->reader->ctx, "%s: rotate: the axis has length %g; it is normalised",
                  imp__loc_text(imp__xml_loc(f), where, sizeof where), length);
    }
    apply(f, imp__rotate(axis * (1 / length), angle));
}

static void act_matrix(struct xml_file *f, const struct xml_attributes *a)
{
    double v[16];
    const int n = imp__value_list(get(a, "value"), 16, v);
    if (n != 16 && n != 9) {
        imp__xml_fail(f, IMP_E_SCENE, "matrix: needs 16 or 9 finite numbers");
        return;
    }
    struct imp_mat4 m = imp__mat4_identity();
    for (int i = 0; i < n; i++) m.m[n == 16 ? i : 4 * (i / 3) + i % 3] = v[i];
    apply(f, m);
}

static void act_lookat(struct xml_file *f, const struct xml_attributes *a)
{
    static const char *const names[] = {"origin", "target", "up"};
    double v[3][3] = {{0}};
    for (int i = 0; i < 3; i++) {
        const char *text = get(a, names[i]);
        if (text && imp__value_list(text, 3, v[i]) != 3) {
            imp__xml_fail(f, IMP_E_SCENE, "lookat: %s = '%.80s' is not three finite numbers",
                          names[i], text);
            return;
        }
    }
    struct imp_mat4 m;
    if (!imp__lookat(imp__v3(v[0][0], v[0][1], v[0][2]), imp__v3(v[1][0], v[1][1], v[1][2]),
                     imp__v3(v[2][0], v[2][1], v[2][2]), &m)) {
        imp__xml_fail(f, IMP_E_SCENE,
                      "lookat: origin and target are equal, or up is parallel to the view");
        return;
    }
    apply(f, m);
}

/* ---- The table ------------------------------------------------------------------------ */

static const struct rule {
    const char *tag, *required, *optional;
    bool operation; /* stands in a transform; all others in an object */
    act_fn *act;
} rules[] = {
    {"integer", "name value", "", false, act_integer},
    {"float", "name value", "", false, act_float},
    {"boolean", "name value", "", false, act_boolean},
    {"string", "name value", "", false, act_string},
    {"point", "name", "value x y z", false, act_vector},
    {"vector", "name", "value x y z", false, act_vector},
    {"rgb", "name value", "", false, act_rgb},
    {"spectrum", "name", "value filename", false, act_spectrum},
    {"ref", "id", "name", false, act_ref},
    {"alias", "id as", "", false, act_alias},
    {"default", "name value", "", false, act_default},
    {"include", "filename", "name", false, act_include},
    {"path", "value", "", false, act_path},
    {"translate", "", "value x y z", true, act_translate},
    {"scale", "", "value x y z", true, act_scale},
    {"rotate", "angle", "value x y z", true, act_rotate},
    {"matrix", "value", "", true, act_matrix},
    {"lookat", "origin target", "up", true, act_lookat},
};

/* "a.b.c" -> a; -1 if malformed. */
static int64_t version_major(const char *text)
{
    int64_t part[3] = {0};
    for (int i = 0; i < 3; i++) {
        char digits[16];
        const size_t n = strspn(text, "0123456789");
        if (!n || n >= sizeof digits || text[n] != (i < 2 ? '.' : 0)) return -1;
        snprintf(digits, sizeof digits, "%.*s", (int)n, text);
        if (!imp__value_integer(digits, &part[i])) return -1;
        text += n + 1;
    }
    return part[0];
}

/* The root of a file. The scene file makes the scene; an included scene is spliced into the
 * parent, its own properties dropped; any other included root is a child of the parent. */
static void root_start(struct xml_file *f, const char *tag, const char **from)
{
    struct xml_reader *r = f->reader;
    struct xml_attributes a;
    const bool scene = strcmp(tag, "scene") == 0;
    if (!imp__is_object_tag(tag) || (!scene && !f->parent)) {
        imp__xml_fail(f, IMP_E_SCENE, "the root must be a <scene>%s, not <%s>",
                      f->parent ? " or an object" : "", tag);
        return;
    }
    if (!attributes_read(f, tag, scene ? "version" : "version type", "id name", from, &a))
        return;
    const int64_t major = version_major(get(&a, "version"));
    if (major < 0) {
        imp__xml_fail(f, IMP_E_SCENE, "version '%.80s' is not 'a.b.c'", get(&a, "version"));
        return;
    }
    f->old = major < 2;
    struct xml_level *l = push(f, XML_OBJECT, "scene");
    if (scene && f->parent) {
        l->node = f->parent;
        l->props = imp__node_create(&r->scene->arena, tag, NULL, NULL, NULL, imp__xml_loc(f));
        if (!l->props) imp__xml_fail(f, IMP_E_NOMEM, "out of memory");
        return;
    }
    imp__xml_fail_placed(
        f, imp__tree_open(&r->tree, f->parent, tag, get(&a, "type"), get(&a, "id"),
                          f->slot ? f->slot : f->parent ? get(&a, "name") : NULL,
                          imp__xml_loc(f), &l->node));
    if (f->st != IMP_OK) return;
    l->props = l->node;
    l->tag = l->node->tag;
}

static void object_start(struct xml_file *f, const char *tag, const char **from)
{
    struct xml_attributes a;
    if (strcmp(tag, "scene") == 0) {
        imp__xml_fail(f, IMP_E_SCENE, "<scene> may only be the root of a file");
        return;
    }
    if (!attributes_read(f, tag, "type", "id name", from, &a)) return;
    const char *name = name_of(f, &a);
    if (f->st != IMP_OK) return;
    struct imp_node *parent = top(f)->node;
    struct xml_level *l = push(f, XML_OBJECT, "object");
    imp__xml_fail_placed(f, imp__tree_open(&f->reader->tree, parent, tag, get(&a, "type"),
                                           get(&a, "id"), name, imp__xml_loc(f), &l->node));
    if (f->st != IMP_OK) return;
    l->props = l->node;
    l->tag = l->node->tag;
}

static void transform_start(struct xml_file *f, const char **from)
{
    struct xml_attributes a;
    if (!attributes_read(f, "transform", "name", "", from, &a)) return;
    struct imp_node *node = top(f)->props;
    struct imp_prop *p = prop_add(f, &a, IMP_PROP_TRANSFORM);
    if (!p) return;
    struct xml_level *l = push(f, XML_TRANSFORM, "transform");
    l->node = node;
    l->prop = p;
    l->matrix = imp__mat4_identity();
}

void imp__xml_start(struct xml_file *f, const char *tag, const char **from)
{
    const struct xml_level *l = top(f);
    if (!l) {
        root_start(f, tag, from);
        return;
    }
    if (l->kind == XML_LEAF) {
        imp__xml_fail(f, IMP_E_SCENE, "<%s> cannot stand inside <%s>", tag, l->tag);
        return;
    }
    if (f->depth >= IMP_DEPTH_MAX) {
        imp__xml_fail(f, IMP_E_SCENE, "tags are nested deeper than %d", IMP_DEPTH_MAX);
        return;
    }
    bool object = imp__is_object_tag(tag);
    if (strcmp(tag, "spectrum") == 0) { /* an object if it has a type */
        object = false;
        for (const char **a = from; *a; a += 2) object |= strcmp(*a, "type") == 0;
    }
    if (l->kind == XML_OBJECT && object) {
        object_start(f, tag, from);
        return;
    }
    if (l->kind == XML_OBJECT && strcmp(tag, "transform") == 0) {
        transform_start(f, from);
        return;
    }
    for (size_t i = 0; i < imp_count(rules); i++) {
        const struct rule *r = &rules[i];
        if (strcmp(r->tag, tag) != 0) continue;
        if (r->operation != (l->kind == XML_TRANSFORM)) break;
        struct xml_attributes a;
        if (!attributes_read(f, tag, r->required, r->optional, from, &a)) return;
        r->act(f, &a);
        push(f, XML_LEAF, r->tag);
        return;
    }
    bool known = object || strcmp(tag, "transform") == 0;
    for (size_t i = 0; i < imp_count(rules); i++) known |= strcmp(rules[i].tag, tag) == 0;
    if (known) imp__xml_fail(f, IMP_E_SCENE, "<%s> cannot stand inside <%s>", tag, l->tag);
    else imp__xml_fail(f, IMP_E_SCENE, "unknown tag <%s>", tag);
}

void imp__xml_end(struct xml_file *f)
{
    const struct xml_level *l = top(f);
    f->depth--;
    if (l->kind == XML_TRANSFORM) memcpy(l->prop->number, l->matrix.m, sizeof l->matrix.m);
    if (l->kind == XML_OBJECT && f->old && strcmp(l->node->tag, "texture") == 0 &&
        l->node == l->props)
        imp__xml_fail_placed(f, imp__upgrade_texture(&f->reader->tree, l->node));
}
