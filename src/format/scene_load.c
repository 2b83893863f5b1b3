/* SPDX-License-Identifier: Apache-2.0
 *
 * imp_scene_load and imp_scene_load_string: options, the scene file, its tree, and the
 * scene that is built from the tree. */
#include "base/arguments.h"
#include "color/convert.h"
#include "film/film_integrator.h"
#include "load.h"
#include "luminaire_files.h"
#include "luminaire_openings.h"
#include "search.h"
#include "setting_lines.h"
#include "tree.h"
#include "twin_scene.h"
#include "xml.h"
#include <string.h>

enum imp_status imp__load_options(imp_context *ctx, const struct imp_load_options *from,
                                  struct imp_load_options *to)
{
    *to = (struct imp_load_options)IMP_LOAD_OPTIONS_INIT;
    IMP_CHECKED(imp__options_take(ctx, "load", "options", from, to, sizeof *to));
    if ((int)to->mode < IMP_RGB || (int)to->mode > IMP_SINGLE)
        return imp__error(ctx, IMP_E_ARG, "colour mode %d is not known", (int)to->mode);
    if ((int)to->upsampling < IMP_UPSAMPLING_SIGMOID ||
        (int)to->upsampling > IMP_UPSAMPLING_LINEAR)
        return imp__error(ctx, IMP_E_ARG, "upsampling %d is not known",
                          (int)to->upsampling);
    if (to->spp < 0)
        return imp__error(ctx, IMP_E_ARG, "spp is %lld: 0 or more", (long long)to->spp);
    if ((to->n_defines && !to->defines) || (to->n_search && !to->search) ||
        (to->n_luminaires && !to->luminaires))
        return imp__error(ctx, IMP_E_ARG,
                          "definitions, search folders or luminaires are NULL");
    return IMP_OK;
}

enum imp_status imp__load_open(imp_context *ctx, const char *path,
                               const struct imp_load_options *options,
                               struct imp__load_file *f)
{
    enum imp_status st = IMP_OK;
    *f = (struct imp__load_file){.name = path};
    if (!path || !*path) return imp__error(ctx, IMP_E_ARG, "no scene file is named");
    IMP_TRY(imp__load_options(ctx, options, &f->options));
    IMP_TRY(imp__file_read(ctx, path, XML_FILE_BYTES_MAX, &f->text));
    f->folder = imp__strdup(ctx, strchr(path, '/') ? path : ".");
    if (!f->folder) IMP_TRY(imp__error(ctx, IMP_E_NOMEM, "%s: out of memory", path));
    char *slash = strrchr(f->folder, '/');
    if (slash) slash[slash == f->folder] = 0;
out:
    return st;
}

void imp__load_close(imp_context *ctx, struct imp__load_file *f)
{
    imp__release(ctx, f->folder);
    imp__bytes_free(ctx, &f->text);
}

enum imp_status imp__load_text(imp_context *ctx, const char *xml, size_t length,
                               const char *name, const struct imp_load_options *options,
                               struct imp__load_file *f)
{
    *f =
        (struct imp__load_file){.text = {(unsigned char *)(uintptr_t)xml, length, length},
                                .name = name && *name ? name : "string"};
    return imp__load_options(ctx, options, &f->options);
}

static void given_count(struct imp_node *node)
{
    node->given_props = (uint32_t)node->n_props;
    node->given_children = (uint32_t)node->n_children;
    for (size_t i = 0; i < node->n_children; i++)
        if (!node->children[i].ref) given_count(node->children[i].node);
}

enum imp_status imp__scene_finish(struct imp_scene *scene)
{
    enum imp_status st = imp__survey(scene);
    if (st == IMP_OK) st = imp__files_attach(scene);
    if (st == IMP_OK) st = imp__luminaire_openings_make(scene);
    if (st == IMP_OK) given_count(scene->root);
    if (st == IMP_OK) st = imp__scene_build(scene, imp__integrator_kinds);
    if (st == IMP_OK) st = imp__graded_finish(scene);
    if (st == IMP_OK) st = imp__survey_finish(scene);
    if (st == IMP_OK) st = imp__settings_apply(scene, scene->settings);
    scene->settings = scene->last_setting = NULL;
    imp__arena_free(&scene->settings_arena);
    scene->twin = imp__scene_twin;
    imp__scene_release_files(scene);
    return st;
}

/* The integrator's property `weights`, in place of the file's. */
static enum imp_status weights_set(struct imp_scene *scene, const char *text)
{
    static const struct imp_loc nowhere = {NULL, 0, 0};
    struct imp_node *node = scene->root;
    for (size_t i = 0; node && i < node->n_children; i++) {
        struct imp_node *child = node->children[i].node;
        if (!child || strcmp(child->tag, "integrator") != 0) continue;
        node = child;
        if (strcmp(node->type, "aov") != 0 && strcmp(node->type, "moment") != 0) break;
        i = SIZE_MAX; /* its children, from the first */
    }
    if (!node || node == scene->root)
        return imp__error(scene->ctx, IMP_E_SCENE,
                          "weights: the scene has no integrator");
    struct imp_prop *p = imp__node_prop(node, "weights");
    if (!p) p = imp__node_add(&scene->arena, node, "weights", IMP_PROP_STRING, nowhere);
    char *copy = imp__arena_strdup(&scene->arena, text);
    if (!p || !copy)
        return imp__error(scene->ctx, IMP_E_NOMEM, "no memory for the scene");
    p->type = IMP_PROP_STRING;
    p->loc = nowhere;
    p->string = copy;
    return IMP_OK;
}

/* Leave out the response curves of a film. */
static void curves_drop(struct imp_node *film)
{
    size_t n = 0;
    for (size_t k = 0; k < film->n_props; k++)
        if (film->props[k].type != IMP_PROP_SPECTRUM &&
            film->props[k].type != IMP_PROP_UNIFORM)
            film->props[n++] = film->props[k];
    film->n_props = n;
    n = 0;
    for (size_t k = 0; k < film->n_children; k++)
        if (!film->children[k].node || !imp__color_is_object(film->children[k].node))
            film->children[n++] = film->children[k];
    film->n_children = n;
}

/* The property `bins` of the films of the sensors in `parent` and in its shapes, in place of
 * the channels in the file. */
static enum imp_status bins_set(struct imp_scene *scene, const struct imp_node *parent,
                                const char *text)
{
    static const struct imp_loc nowhere = {NULL, 0, 0};
    struct imp_arena *arena = &scene->arena;
    for (size_t i = 0; parent && i < parent->n_children; i++) {
        struct imp_node *sensor = parent->children[i].node, *film = NULL;
        if (sensor && parent == scene->root && strcmp(sensor->tag, "shape") == 0) {
            const enum imp_status st = bins_set(scene, sensor, text);
            if (st != IMP_OK) return st;
        }
        if (!sensor || strcmp(sensor->tag, "sensor") != 0) continue;
        for (size_t k = 0; k < sensor->n_children; k++) {
            struct imp_node *child = sensor->children[k].node;
            if (child && strcmp(child->tag, "film") == 0) film = child;
        }
        if (!film)
            return imp__node_error(scene->ctx, sensor, IMP_E_SCENE,
                                   "bins: this sensor has no film");
        curves_drop(film);
        struct imp_prop *p = imp__node_prop(film, "bins");
        if (!p) p = imp__node_add(arena, film, "bins", IMP_PROP_STRING, nowhere);
        char *copy = imp__arena_strdup(arena, text);
        film->type = imp__arena_strdup(arena, "specfilm");
        if (!p || !copy || !film->type)
            return imp__error(scene->ctx, IMP_E_NOMEM, "no memory for the scene");
        p->type = IMP_PROP_STRING;
        p->string = copy;
    }
    return IMP_OK;
}

static enum imp_status load(imp_context *ctx, const struct imp__load_file *f,
                            imp_scene **out)
{
    enum imp_status st = IMP_OK;
    const struct imp_load_options *o = &f->options;
    struct imp_scene *scene = NULL;
    IMP_TRY(imp__scene_new(ctx, o->mode, o->upsampling, &scene));
    scene->lenient = o->lenient;
    scene->spp = o->spp;
    IMP_TRY(imp__search_init(scene, o->search, o->n_search, f->folder));
    IMP_TRY(imp__xml_read(scene, &f->text, f->name, o));
    if (o->weights) IMP_TRY(weights_set(scene, o->weights));
    IMP_TRY(imp__luminaire_files_set(scene, o->luminaires, o->n_luminaires));
    if (o->bins) IMP_TRY(bins_set(scene, scene->root, o->bins));
    IMP_TRY(imp__scene_finish(scene));
    *out = scene;
    return IMP_OK;
out:
    imp_scene_destroy(scene);
    return st;
}

enum imp_status imp_scene_load(imp_context *ctx, const char *path,
                               const struct imp_load_options *options, imp_scene **out)
{
    IMP_REQUIRE(NULL, ctx, "context");
    IMP_REQUIRE(ctx, path, "path");
    IMP_REQUIRE(ctx, out, "out");
    IMP_FLOAT_MODE;
    struct imp__load_file f;
    enum imp_status st = imp__load_open(ctx, path, options, &f);
    if (st == IMP_OK) st = load(ctx, &f, out);
    imp__load_close(ctx, &f);
    return st;
}

enum imp_status imp_scene_load_string(imp_context *ctx, const char *xml, size_t length,
                                      const char *name,
                                      const struct imp_load_options *options,
                                      imp_scene **out)
{
    IMP_REQUIRE(NULL, ctx, "context");
    IMP_REQUIRE(ctx, xml, "xml");
    IMP_REQUIRE(ctx, out, "out");
    IMP_FLOAT_MODE;
    struct imp__load_file f;
    IMP_CHECKED(imp__load_text(ctx, xml, length, name, options, &f));
    return load(ctx, &f, out);
}
