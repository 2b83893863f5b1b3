/* SPDX-License-Identifier: Apache-2.0
 *
 * What a scene names and this version does not have: all of it at once, before anything is
 * made. A lenient scene goes on without: each such object is removed or replaced, with a
 * warning that names what is lost. */
#include "color/color_set.h"
#include "film/film_integrator.h"
#include "kind/registry.h"
#include "kind/sensor/sensor_film.h"
#include "light_units.h"
#include "load.h"
#include "scene/instances.h"
#include "scene/scene_build.h"
#include <stdio.h>
#include <string.h>

/* The replacement of an object of a tag that cannot be made. */
static const struct rule {
    const char *tag;
    int concept;      /* enum imp_concept, or one of these: */
    const char *lost; /* where it is removed, or replaced */
    const char *type; /* that replaces it; NULL: it is removed */
} rules[] = {
    {"bsdf", IMP_CONCEPT_BSDF, "its surfaces are diffuse grey", "diffuse"},
    {"texture", IMP_CONCEPT_TEXTURE, "the slot has its default", NULL},
    {"shape", IMP_CONCEPT_SHAPE, "it is left out, and its light", NULL},
    {"emitter", IMP_CONCEPT_EMITTER, "its light is missing", NULL},
    {"sensor", IMP_CONCEPT_SENSOR, "sensors after it have other numbers", NULL},
    {"rfilter", IMP_CONCEPT_FILTER, "the film has a gaussian", NULL},
    {"volume", IMP_CONCEPT_VOLUME, "the slot has its default", NULL},
    {"phase", IMP_CONCEPT_PHASE, "the medium scatters alike in all directions", NULL},
    {"medium", IMP_CONCEPT_MEDIUM, "nothing scatters there", NULL},
};

/* Names of a rule's kinds; NULL after the last. */
static const char *kind_name(const struct imp_scene *scene, const struct rule *r,
                             size_t i)
{
    const struct {
        size_t size;
        const char *name;
    } *head = imp__kind_at(scene->ctx, (enum imp_concept)r->concept, i);
    return head ? head->name : NULL;
}

static bool is_kind(const struct imp_scene *scene, const struct rule *r,
                    const struct imp_node *node)
{
    const char *name;
    for (size_t i = 0; (name = kind_name(scene, r, i)); i++)
        if (strcmp(name, node->type) == 0) return true;
    if (imp__is_group(node) || imp__is_instance(node)) return true;
    return r->concept == IMP_CONCEPT_MEDIUM && strcmp(node->type, "graded") == 0;
}

static const struct rule *rule_of(const struct imp_node *node)
{
    for (size_t k = 0; k < imp_count(rules); k++)
        if (strcmp(rules[k].tag, node->tag) == 0) return &rules[k];
    return NULL;
}

static const void *integrator_at(const void *payload, size_t i)
{
    (void)payload;
    return imp__integrator_kinds[i];
}

/* Tags without a concept: what replaces an object of a kind that there is not, and the
 * properties that it keeps, between blanks. */
static const struct stand_in {
    const char *tag;
    const void *(*at)(const void *payload, size_t i);
    const char *lost, *type, *kept;
} stand_ins[] = {
    {"integrator", integrator_at, "the picture is that of path", "path",
     " max_depth hide_emitters "},
    {"film", imp__film_at, "a hdrfilm in its place, with its size", "hdrfilm",
     " width height crop_offset_x crop_offset_y crop_width crop_height "},
    {"sampler", imp__sampler_at, "an independent one in its place", "independent",
     " sample_count "},
};

static const struct stand_in *stand_in_of(const struct imp_node *node)
{
    for (size_t k = 0; k < imp_count(stand_ins); k++)
        if (strcmp(stand_ins[k].tag, node->tag) == 0) return &stand_ins[k];
    return NULL;
}
static const char *stand_in_name(const struct stand_in *s, size_t i)
{
    const struct {
        size_t size;
        const char *name;
    } *head = s->at(NULL, i);
    return head ? head->name : NULL;
}
static bool is_there(const struct stand_in *s, const char *type)
{
    const char *name;
    for (size_t i = 0; (name = stand_in_name(s, i)); i++)
        if (strcmp(name, type) == 0) return true;
    return false;
}

struct survey {
    struct imp_scene *scene;
    int n;                 /* types that are not supported */
    struct missing **type; /* in the order they were met */
};
struct missing {
    const struct imp_node *first;
    int others; /* of the same type */
};

enum imp_status imp__lost_add(struct imp_scene *scene, const char *text)
{
    char *copy = imp__arena_strdup(&scene->arena, text);
    if (!copy) return imp__error(scene->ctx, IMP_E_NOMEM, "scene: out of memory");
    if (scene->lenient == IMP_LENIENT_WARN) imp__warn(scene->ctx, "%s", text);
    return imp__build_list_add(scene, (void ***)&scene->missing, &scene->n_missing, copy);
}

/* The kind whose name is nearest to the node's type, or NULL. */
static const char *kind_meant(const struct imp_scene *scene, const struct imp_node *node)
{
    const struct rule *r = rule_of(node);
    const struct stand_in *s = stand_in_of(node);
    const char *name;
    struct imp_nearest near = imp__nearest(node->type);
    for (size_t i = 0; r && (name = kind_name(scene, r, i)); i++)
        imp__nearest_try(&near, name);
    for (size_t i = 0; s && (name = stand_in_name(s, i)); i++)
        imp__nearest_try(&near, name);
    return near.best;
}

static enum imp_status note(struct survey *s, const struct imp_node *node,
                            const char *lost)
{
    char where[256], text[512];
    imp__loc_text(node->loc, where, sizeof where);
    if (s->scene->lenient) {
        const char *near = kind_meant(s->scene, node);
        snprintf(text, sizeof text, "%s: %s %s%s%s%s: not supported; %s%s%s%s", where,
                 node->tag, node->type, node->id ? " '" : "", node->id ? node->id : "",
                 node->id ? "'" : "", lost, near ? " (did you mean '" : "",
                 near ? near : "", near ? "'?)" : "");
        return imp__lost_add(s->scene, text);
    }
    for (int k = 0; k < s->n; k++) {
        struct missing *m = s->type[k];
        if (strcmp(m->first->tag, node->tag) == 0 &&
            strcmp(m->first->type, node->type) == 0) {
            m->others++;
            return IMP_OK;
        }
    }
    struct missing *m = imp__arena_array(&s->scene->arena, 1, sizeof *m);
    if (!m) return imp__build_no_memory(s->scene);
    m->first = node;
    return imp__build_list_add(s->scene, (void ***)&s->type, &s->n, m);
}

static void child_remove(struct imp_node *parent, size_t i)
{
    parent->n_children--;
    memmove(&parent->children[i], &parent->children[i + 1],
            (parent->n_children - i) * sizeof *parent->children);
}

/* A material around another becomes one that changes nothing; others a plain one. */
static enum imp_status material_replace(struct imp_scene *scene, struct imp_node *node,
                                        const char *type)
{
    struct imp_child *nested = NULL;
    for (size_t i = 0; i < node->n_children && !nested; i++)
        if (node->children[i].node && strcmp(node->children[i].node->tag, "bsdf") == 0)
            nested = &node->children[i];
    node->n_props = 0;
    node->type = nested ? "mask" : type;
    node->n_children = nested != NULL;
    if (!nested) return IMP_OK;
    node->children[0] = *nested;
    node->children[0].name = NULL;
    struct imp_prop *p =
        imp__node_add(&scene->arena, node, "opacity", IMP_PROP_FLOAT, node->loc);
    if (!p) return imp__error(scene->ctx, IMP_E_NOMEM, "scene: out of memory");
    p->number[0] = 1;
    return IMP_OK;
}

/* The node becomes what replaces it, with the properties that both have; a film keeps its
 * filter. */
static void stand_in_take(struct imp_node *node, const struct stand_in *s)
{
    size_t kept = 0;
    for (size_t i = 0; i < node->n_props; i++) {
        const char *name = node->props[i].name, *at = strstr(s->kept, name);
        if (at && at[-1] == ' ' && at[strlen(name)] == ' ')
            node->props[kept++] = node->props[i];
    }
    node->n_props = kept;
    if (strcmp(node->tag, "film") != 0) node->n_children = 0;
    node->type = s->type;
}

/* Child i, a `merge`, is replaced by the shapes in it, in its place: Mitsuba
 * makes one mesh of those of one material, and here each keeps its numbers. */
static enum imp_status merge_open(struct imp_scene *scene, struct imp_node *parent,
                                  size_t i)
{
    struct imp_node *merge = parent->children[i].node;
    /* One that is in the scene already adds nothing: references to references would
     * else open it any number of times. */
    const size_t m = merge->surveyed ? 0 : merge->n_children, n = parent->n_children;
    merge->surveyed = true;
    struct imp_child *child = imp__arena_array(&scene->arena, n + m, sizeof *child);
    if (!child) return imp__error(scene->ctx, IMP_E_NOMEM, "scene: out of memory");
    for (size_t k = 0; k < m; k++)
        if (strcmp(merge->children[k].node->tag, "shape") != 0)
            return imp__node_error(scene->ctx, merge, IMP_E_SCENE,
                                   "holds shapes only, not a %s",
                                   merge->children[k].node->tag);
    if (merge->n_props > 0)
        return imp__prop_error(scene->ctx, merge, &merge->props[0], IMP_E_SCENE,
                               "not a property of this plugin: %s", merge->props[0].name);
    memcpy(child, parent->children, i * sizeof *child);
    for (size_t k = 0; k < m; k++) {
        child[i + k] = merge->children[k];
        if (child[i + k].name && imp__node_child(parent, child[i + k].name))
            child[i + k].name = NULL; /* that of another */
    }
    memcpy(child + i + m, parent->children + i + 1, (n - i - 1) * sizeof *child);
    parent->children = child;
    parent->n_children = parent->cap_children = n + m - 1;
    return IMP_OK;
}

/* Is what the node is supported? *gone: its parent goes on without it. */
static enum imp_status look(struct survey *s, struct imp_node *node, bool *gone)
{
    const bool lenient = s->scene->lenient;
    const struct rule *r = rule_of(node);
    enum imp_status st = IMP_OK;
    *gone = false;
    const struct stand_in *other = stand_in_of(node);
    if (other && !is_there(other, node->type)) {
        IMP_TRY(note(s, node, other->lost));
        if (lenient) stand_in_take(node, other);
    }
    if (!r || imp__color_is_object(node) || is_kind(s->scene, r, node)) return IMP_OK;
    const bool nested = strcmp(node->tag, "bsdf") == 0 && node->n_children > 0;
    IMP_TRY(note(s, node, nested ? "what is nested in it replaces it" : r->lost));
    if (!lenient) return IMP_OK;
    *gone = !r->type;
    if (r->type) IMP_TRY(material_replace(s->scene, node, r->type));
out:
    return st;
}

static enum imp_status walk(struct survey *s, struct imp_node *node)
{
    enum imp_status st = IMP_OK;
    if (node->surveyed) return IMP_OK;
    node->surveyed = true;
    node->lenient = s->scene->lenient;
    /* What describes a field of indices has names of its own (graded_file.c). */
    if (strcmp(node->tag, "medium") == 0 && strcmp(node->type, "graded") == 0)
        return IMP_OK;
    for (size_t i = 0; i < node->n_children; i++) {
        struct imp_node *child = node->children[i].node;
        bool gone = child->gone;
        child->referred |= node->children[i].ref != NULL;
        if (strcmp(child->tag, "shape") == 0 && strcmp(child->type, "merge") == 0) {
            IMP_TRY(merge_open(s->scene, node, i--));
            continue;
        }
        if (!child->surveyed) IMP_TRY(look(s, child, &gone));
        child->gone = gone;
        if (gone) child_remove(node, i--);
        else IMP_TRY(walk(s, child));
    }
out:
    return st;
}

enum imp_status imp__survey(struct imp_scene *scene)
{
    struct survey s = {.scene = scene};
    const enum imp_status st = scene->root ? walk(&s, scene->root) : IMP_OK;
    if (st != IMP_OK || s.n < 2) return st; /* the builder reports a single one */
    char first[1024], list[960] = "", where[128], entry[256];
    const void *none;
    const struct imp_node *node = s.type[0]->first;
    const struct rule *r = rule_of(node);
    const enum imp_status why =
        r ? imp__kind_find(scene->ctx, (enum imp_concept)r->concept, node, &none)
          : imp__kind_choose(scene->ctx, node, stand_in_of(node)->at, NULL, &none);
    snprintf(first, sizeof first, "%s", imp_last_error(scene->ctx));
    int k = 1;
    for (size_t n = 0; k < s.n; k++) {
        const struct missing *m = s.type[k];
        const int length = snprintf(entry, sizeof entry, "%s%s %.80s (%s%s)",
                                    k > 1 ? ", " : "", m->first->tag, m->first->type,
                                    imp__loc_text(m->first->loc, where, sizeof where),
                                    m->others ? " and elsewhere" : "");
        if (length < 0 || n + (size_t)length + 32 > sizeof list)
            break; /* " and N more" */
        n += (size_t)snprintf(list + n, sizeof list - n, "%s", entry);
    }
    if (k < s.n)
        snprintf(list + strlen(list), sizeof list - strlen(list), " and %d more types",
                 s.n - k);
    return imp__error(scene->ctx, why, "%s; nor has it %s", first, list);
}

static enum imp_status unused_list(struct imp_scene *scene, struct imp_node *node)
{
    enum imp_status st = IMP_OK;
    char where[256], text[512];
    if (!node->surveyed) return IMP_OK; /* seen */
    node->surveyed = false;
    for (size_t i = 0; i < node->n_props; i++) {
        const struct imp_prop *p = &node->props[i];
        if (p->used || !node->read) continue;
        imp__loc_text(p->loc, where, sizeof where);
        const char *near = imp__node_meant(node, p->name);
        snprintf(text, sizeof text, "%s: %s %s: no property '%s'; it is left out%s%s%s",
                 where, node->tag, node->type, p->name, near ? " (did you mean '" : "",
                 near ? near : "", near ? "'?)" : "");
        IMP_TRY(imp__lost_add(scene, text));
    }
    for (size_t i = 0; i < node->n_children; i++) {
        const struct imp_child *c = &node->children[i];
        if (!c->used && node->read) {
            imp__loc_text(c->loc, where, sizeof where);
            const char *near = c->name ? imp__node_meant(node, c->name) : NULL;
            snprintf(text, sizeof text,
                     "%s: %s %s: has no place for a %s%s%s%s; it is left out%s%s%s",
                     where, node->tag, node->type, c->node->tag, c->name ? " '" : "",
                     c->name ? c->name : "", c->name ? "'" : "",
                     near ? " (did you mean '" : "", near ? near : "", near ? "'?)" : "");
            IMP_TRY(imp__lost_add(scene, text));
        }
        IMP_TRY(unused_list(scene, c->node));
    }
out:
    return st;
}

/* What is declared at the top for others, and used by none of them: it does nothing. */
static void idle_list(struct imp_scene *scene)
{
    static const char *const idle[][2] = {
        {"emitter", "no shape refers to it: it sends no light"},
        {"sensor", "no shape refers to it: it makes no picture"},
        {"film", "no sensor refers to it: its pixels and format are not used"},
        {"sampler", "no sensor refers to it: its sample_count is not used"},
        {"rfilter", "no film refers to it: it is not used"},
        {"phase", "no medium refers to it: it is not used"},
        {"volume", "no medium refers to it: it is not used"},
    };
    char where[256];
    for (size_t i = 0; i < scene->root->n_children; i++) {
        const struct imp_node *node = scene->root->children[i].node;
        for (size_t k = 0; k < imp_count(idle); k++)
            if (!node->object && !node->referred && strcmp(node->tag, idle[k][0]) == 0)
                imp__warn(scene->ctx, "%s: %s%s%s%s (%s): %s",
                          imp__loc_text(node->loc, where, sizeof where), node->tag,
                          node->id ? " '" : "", node->id ? node->id : "",
                          node->id ? "'" : "", node->type, idle[k][1]);
    }
}

enum imp_status imp__survey_finish(struct imp_scene *scene)
{
    if (!scene->root) return IMP_OK;
    if (!scene->rayless) { /* a second scene: the first has reported it */
        idle_list(scene);
        imp__light_units_unsaid(scene);
    }
    return scene->lenient ? unused_list(scene, scene->root) : IMP_OK;
}
