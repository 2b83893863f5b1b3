/* SPDX-License-Identifier: Apache-2.0
 *
 * The grammar: one rule a tag, which attributes it takes and what it does
 * (docs/scene-format.md 1.1). */
#include "base/nearest.h"
#include "search.h"
#include "value.h"
#include "xml.h"
#include <stdio.h>
#include <string.h>

/* ---- Attributes ---------------------------------------------------------------- */

const char *imp__xml_get(const struct xml_attributes *a, const char *name)
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
            imp__xml_fail(f, IMP_E_SCENE, "<%s> has no attribute '%s' (it has: %s%s%s)",
                          tag, from[0], required, *required && *optional ? " " : "",
                          optional);
            return false;
        }
        const enum imp_status st = imp__params_expand(
            &f->reader->params, &f->reader->scratch, from[1], &to->at[to->n].value);
        if (st != IMP_OK) {
            imp__xml_fail_here(f, st);
            return false;
        }
        to->at[to->n++].name =
            from[0]; /* at most all listed words: expat refuses repeats */
    }
    for (const char *s = required; *s; s += strspn(s, " ")) {
        char word[32];
        const size_t length = strcspn(s, " ");
        snprintf(word, sizeof word, "%.*s", (int)length, s);
        if (!imp__xml_get(to, word)) {
            imp__xml_fail(f, IMP_E_SCENE, "<%s> needs the attribute '%s'", tag, word);
            return false;
        }
        s += length;
    }
    return true;
}

/* ---- Levels -------------------------------------------------------------------- */

struct xml_level *imp__xml_top(struct xml_file *f)
{
    return f->depth ? &f->levels[f->depth - 1] : NULL;
}

static struct xml_level *push(struct xml_file *f, enum xml_level_kind kind,
                              const char *tag)
{
    struct xml_level *l = &f->levels[f->depth++];
    *l = (struct xml_level){.kind = kind, .tag = tag};
    return l;
}

/* The name attribute, upgraded if the file is old; NULL if there is none or f failed. */
const char *imp__xml_name(struct xml_file *f, const struct xml_attributes *a)
{
    const char *name = imp__xml_get(a, "name");
    const struct xml_level *l = imp__xml_top(f);
    if (!name || !f->old) return name;
    name =
        imp__upgrade_name(&f->reader->scratch, l && l->props ? l->props->type : "", name);
    if (!name) imp__xml_fail(f, IMP_E_NOMEM, "out of memory");
    return name;
}

/* ---- References, parameters, files --------------------------------------------- */

static void act_ref(struct xml_file *f, const struct xml_attributes *a)
{
    const char *name = imp__xml_name(f, a);
    if (f->st != IMP_OK) return;
    imp__xml_fail_placed(f, imp__tree_ref(&f->reader->tree, imp__xml_top(f)->node,
                                          imp__xml_get(a, "id"), name, imp__xml_loc(f)));
}

static void act_alias(struct xml_file *f, const struct xml_attributes *a)
{
    imp__xml_fail_placed(f, imp__tree_alias(&f->reader->tree, imp__xml_get(a, "id"),
                                            imp__xml_get(a, "as"), imp__xml_loc(f)));
}

static void act_default(struct xml_file *f, const struct xml_attributes *a)
{
    const char *name = imp__xml_get(a, "name");
    if (!*name) {
        imp__xml_fail(f, IMP_E_SCENE, "default: empty name");
        return;
    }
    const enum imp_status st =
        imp__params_default(&f->reader->params, name, imp__xml_get(a, "value"));
    if (st != IMP_OK) imp__xml_fail_here(f, st);
}

static void act_include(struct xml_file *f, const struct xml_attributes *a)
{
    const char *name = imp__xml_name(f, a);
    if (f->st == IMP_OK)
        imp__xml_include(f, imp__xml_get(a, "filename"), name, imp__xml_top(f)->node);
}

static void act_path(struct xml_file *f, const struct xml_attributes *a)
{
    if (f->depth != 1) {
        imp__xml_fail(f, IMP_E_SCENE, "<path> belongs in the root of a file");
        return;
    }
    const char *folder;
    enum imp_status st =
        imp__search(f->reader->scene, f->folder, imp__xml_get(a, "value"), &folder);
    if (st == IMP_OK) st = imp__search_push(f->reader->scene, folder);
    if (st != IMP_OK) imp__xml_fail_here(f, st);
}

/* ---- The table ----------------------------------------------------------------- */

static const struct rule {
    const char *tag, *required, *optional;
    bool operation; /* inside a transform; all others inside an object */
    imp__xml_act *act;
} rules[] = {
    {"integer", "name value", "", false, imp__xml_integer},
    {"float", "name value", "", false, imp__xml_float},
    {"boolean", "name value", "", false, imp__xml_boolean},
    {"string", "name value", "", false, imp__xml_string},
    {"point", "name", "value x y z", false, imp__xml_vector},
    {"vector", "name", "value x y z", false, imp__xml_vector},
    {"rgb", "name value", "", false, imp__xml_rgb},
    {"spectrum", "name", "value filename", false, imp__xml_spectrum},
    {"ref", "id", "name", false, act_ref},
    {"alias", "id as", "", false, act_alias},
    {"default", "name value", "", false, act_default},
    {"include", "filename", "name", false, act_include},
    {"path", "value", "", false, act_path},
    {"set", "", "name value filename", false, imp__xml_set},
    {"translate", "", "value x y z", true, imp__xml_translate},
    {"scale", "", "value x y z", true, imp__xml_scale},
    {"rotate", "angle", "value x y z", true, imp__xml_rotate},
    {"matrix", "value", "", true, imp__xml_matrix},
    {"lookat", "origin target", "up", true, imp__xml_lookat},
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

/* The root of a file. The scene file makes the scene; an included scene is spliced into
 * the parent, its own properties dropped; any other included root is a child of the
 * parent. */
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
    const int64_t major = version_major(imp__xml_get(&a, "version"));
    if (major < 0) {
        imp__xml_fail(f, IMP_E_SCENE, "version '%.80s' is not 'a.b.c'",
                      imp__xml_get(&a, "version"));
        return;
    }
    f->old = major < 2;
    struct xml_level *l = push(f, XML_OBJECT, "scene");
    if (scene && f->parent) {
        l->node = f->parent;
        l->props =
            imp__node_create(&r->scene->arena, tag, NULL, NULL, NULL, imp__xml_loc(f));
        if (!l->props) imp__xml_fail(f, IMP_E_NOMEM, "out of memory");
        return;
    }
    imp__xml_fail_placed(f,
                         imp__tree_open(&r->tree, f->parent, tag,
                                        imp__xml_get(&a, "type"), imp__xml_get(&a, "id"),
                                        f->slot     ? f->slot
                                        : f->parent ? imp__xml_get(&a, "name")
                                                    : NULL,
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
    const char *name = imp__xml_name(f, &a);
    if (f->st != IMP_OK) return;
    struct imp_node *parent = imp__xml_top(f)->node;
    struct xml_level *l = push(f, XML_OBJECT, "object");
    imp__xml_fail_placed(
        f, imp__tree_open(&f->reader->tree, parent, tag, imp__xml_get(&a, "type"),
                          imp__xml_get(&a, "id"), name, imp__xml_loc(f), &l->node));
    if (f->st != IMP_OK) return;
    l->props = l->node;
    l->tag = l->node->tag;
}

static void transform_start(struct xml_file *f, const char **from)
{
    struct xml_attributes a;
    if (!attributes_read(f, "transform", "name", "", from, &a)) return;
    struct imp_node *node = imp__xml_top(f)->props;
    struct imp_prop *p = imp__xml_prop(f, &a, IMP_PROP_TRANSFORM);
    if (!p) return;
    struct xml_level *l = push(f, XML_TRANSFORM, "transform");
    l->node = node;
    l->prop = p;
    l->matrix = imp__mat4_identity();
}

void imp__xml_start(struct xml_file *f, const char *tag, const char **from)
{
    const struct xml_level *l = imp__xml_top(f);
    if (!l) {
        root_start(f, tag, from);
        return;
    }
    if (l->kind == XML_LEAF) {
        imp__xml_fail(f, IMP_E_SCENE, "<%s> cannot be inside <%s>", tag, l->tag);
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
    const char *of;
    bool known = object || strcmp(tag, "transform") == 0;
    struct imp_nearest near = imp__nearest(tag);
    for (size_t i = 0; i < imp_count(rules); i++) {
        known |= strcmp(rules[i].tag, tag) == 0;
        imp__nearest_try(&near, rules[i].tag);
    }
    static const char *const others[] = {"bsdf",  "emitter", "film",    "integrator",
                                         "scene", "sensor",  "sampler", "shape",
                                         "ref",   "texture", "rfilter", "transform"};
    for (size_t i = 0; i < imp_count(others); i++) imp__nearest_try(&near, others[i]);
    if (known) imp__xml_fail(f, IMP_E_SCENE, "<%s> cannot be inside <%s>", tag, l->tag);
    else if (near.best)
        imp__xml_fail(f, IMP_E_SCENE, "unknown tag <%s>; did you mean <%s>?", tag,
                      near.best);
    else if (imp__tag_of_type(f->reader->ctx, tag, &of) == IMP_OK)
        imp__xml_fail(f, IMP_E_SCENE, "unknown tag <%s>; it is a type: <%s type=\"%s\">",
                      tag, of, tag);
    else imp__xml_fail(f, IMP_E_SCENE, "unknown tag <%s>", tag);
}

void imp__xml_end(struct xml_file *f)
{
    const struct xml_level *l = imp__xml_top(f);
    f->depth--;
    if (l->kind == XML_TRANSFORM)
        memcpy(l->prop->number, l->matrix.m, sizeof l->matrix.m);
    if (l->kind == XML_OBJECT && f->old && strcmp(l->node->tag, "texture") == 0 &&
        l->node == l->props)
        imp__xml_fail_placed(f, imp__upgrade_texture(&f->reader->tree, l->node));
}
