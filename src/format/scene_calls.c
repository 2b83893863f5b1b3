/* SPDX-License-Identifier: Apache-2.0
 *
 * Scenes built by calls: the same tree that the XML reader makes. The first failure is
 * kept; later calls do nothing, and return it as commit does. */
#include "scene_calls.h"
#include "base/arguments.h"
#include "load.h"
#include "search.h"
#include "tree.h"
#include "value.h"
#include <math.h>
#include <stdio.h>
#include <string.h>

static const struct imp_loc nowhere = {NULL, 0, 0};

static enum imp_status failed_before(const struct imp_scene *scene)
{
    return imp__error(scene->ctx, scene->build_status, "%s",
                      scene->build_error ? scene->build_error : "scene: out of memory");
}

bool imp__calls_ready(struct imp_scene *scene)
{
    if (!scene) imp__error(NULL, IMP_E_ARG, "imp_scene_begin ...: scene is NULL");
    if (!scene) return false;
    if (scene->build_status != IMP_OK) {
        failed_before(scene);
        return false;
    }
    if (!scene->tree) imp__error(scene->ctx, IMP_E_ARG, "scene: it is committed already");
    return scene->tree != NULL;
}

void imp__calls_keep(struct imp_scene *scene, enum imp_status st)
{
    if (st == IMP_OK) return;
    scene->build_status = st;
    scene->build_error = imp__strdup(scene->ctx, imp_last_error(scene->ctx));
}

enum imp_status imp__calls_outcome(const struct imp_scene *scene)
{
    if (!scene) return IMP_E_ARG;
    if (scene->build_status != IMP_OK) return scene->build_status;
    return scene->tree ? IMP_OK : IMP_E_ARG; /* it is committed */
}

static enum imp_status push(struct imp_scene *scene, struct imp_node *node)
{
    struct imp_node **grown = imp__grow(scene->ctx, scene->stack, &scene->cap_stack,
                                        scene->n_stack + 1, sizeof *grown);
    if (!grown) return imp__error(scene->ctx, IMP_E_NOMEM, "scene: out of memory");
    scene->stack = grown;
    scene->stack[scene->n_stack++] = node;
    return IMP_OK;
}

static void tree_destroy(void *tree) { imp__tree_free(tree); }

enum imp_status imp_scene_create(imp_context *ctx, const struct imp_load_options *options,
                                 imp_scene **out)
{
    IMP_REQUIRE(NULL, ctx, "context");
    IMP_REQUIRE(ctx, out, "out");
    IMP_FLOAT_MODE;
    enum imp_status st = IMP_OK;
    struct imp_scene *scene = NULL;
    struct imp_load_options o;
    struct imp_node *root;
    IMP_TRY(imp__load_options(ctx, options, &o));
    if (o.n_defines)
        IMP_TRY(imp__error(ctx, IMP_E_ARG, "definitions are of use in scene files only"));
    if (o.bins)
        IMP_TRY(imp__error(ctx, IMP_E_ARG,
                           "bins are of use with scene files only; set the film's "
                           "property"));
    if (o.weights)
        IMP_TRY(imp__error(ctx, IMP_E_ARG,
                           "weights are of use with scene files only; set the "
                           "integrator's property"));
    IMP_TRY(imp__scene_new(ctx, o.mode, o.upsampling, &scene));
    scene->lenient = o.lenient;
    scene->spp = o.spp;
    IMP_TRY(imp__search_init(scene, o.search, o.n_search, NULL));
    scene->tree = imp__arena_array(&scene->arena, 1, sizeof *scene->tree);
    if (!scene->tree) IMP_TRY(imp__error(ctx, IMP_E_NOMEM, "scene: out of memory"));
    imp__tree_init(scene->tree, scene);
    IMP_TRY(imp__scene_own(scene, scene->tree, tree_destroy));
    IMP_TRY(imp__tree_open(scene->tree, NULL, "scene", NULL, NULL, NULL, nowhere, &root));
    IMP_TRY(push(scene, root));
    scene->root = root;
    *out = scene;
    return IMP_OK;
out:
    imp_scene_destroy(scene);
    return st;
}

static enum imp_status begin(struct imp_scene *scene, const char *tag, const char *type,
                             const char *id, const char *name)
{
    imp_context *ctx = scene->ctx;
    struct imp_node *node;
    if (!type) return imp__error(ctx, IMP_E_ARG, "imp_scene_begin: type is NULL");
    if (!tag) IMP_CHECKED(imp__tag_of_type(ctx, type, &tag));
    if (!imp__is_object_tag(tag) || strcmp(tag, "scene") == 0)
        return imp__error(ctx, IMP_E_ARG, "scene: '%s' of type '%s' is no object", tag,
                          type);
    if (scene->n_stack >= IMP_DEPTH_MAX)
        return imp__error(ctx, IMP_E_SCENE, "scene: objects are nested deeper than %d",
                          IMP_DEPTH_MAX);
    const enum imp_status st = imp__tree_open(scene->tree, imp__calls_top(scene), tag,
                                              type, id, name, nowhere, &node);
    return st == IMP_OK ? push(scene, node) : st;
}

enum imp_status imp_scene_begin(imp_scene *scene, const char *tag, const char *type,
                                const char *id, const char *name)
{
    if (imp__calls_ready(scene))
        imp__calls_keep(scene, begin(scene, tag, type, id, name));
    return imp__calls_outcome(scene);
}

enum imp_status imp_scene_end(imp_scene *scene)
{
    if (!imp__calls_ready(scene)) return imp__calls_outcome(scene);
    if (scene->n_stack == 1)
        imp__calls_keep(scene,
                        imp__error(scene->ctx, IMP_E_ARG, "scene: end without begin"));
    else scene->n_stack--;
    return imp__calls_outcome(scene);
}

/* ---- Properties ---------------------------------------------------------------- */

/* A new property of the open object; NULL: the build has failed. */
static struct imp_prop *prop(struct imp_scene *scene, const char *name,
                             enum imp_prop_type type)
{
    struct imp_prop *p = NULL;
    if (!imp__calls_ready(scene)) return NULL;
    if (!name)
        imp__calls_keep(
            scene, imp__error(scene->ctx, IMP_E_ARG, "scene: a property's name is NULL"));
    else
        imp__calls_keep(scene, imp__tree_prop(scene->tree, imp__calls_top(scene), name,
                                              type, nowhere, &p));
    return scene->build_status == IMP_OK ? p : NULL;
}

static void numbers(struct imp_scene *scene, const char *name, enum imp_prop_type type,
                    const double *value, int n)
{
    struct imp_prop *p = prop(scene, name, type);
    if (!p) return;
    if (!value)
        imp__calls_keep(scene, imp__error(scene->ctx, IMP_E_ARG,
                                          "scene: value of %s '%s' is NULL",
                                          imp__calls_top(scene)->tag, name));
    for (int i = 0; value && i < n; i++) {
        if (!isfinite(value[i])) {
            imp__calls_keep(
                scene, imp__error(scene->ctx, IMP_E_ARG, "scene: value of %s '%s' is %g",
                                  imp__calls_top(scene)->tag, name, value[i]));
            return;
        }
        p->number[i] = value[i];
    }
}

enum imp_status imp_scene_bool(imp_scene *scene, const char *name, bool value)
{
    struct imp_prop *p = prop(scene, name, IMP_PROP_BOOL);
    if (p) p->integer = value;
    return imp__calls_outcome(scene);
}

enum imp_status imp_scene_integer(imp_scene *scene, const char *name, int64_t value)
{
    struct imp_prop *p = prop(scene, name, IMP_PROP_INTEGER);
    if (p) p->integer = value;
    return imp__calls_outcome(scene);
}

enum imp_status imp_scene_float(imp_scene *scene, const char *name, double value)
{
    numbers(scene, name, IMP_PROP_FLOAT, &value, 1);
    return imp__calls_outcome(scene);
}

enum imp_status imp_scene_vector(imp_scene *scene, const char *name,
                                 const double value[3])
{
    numbers(scene, name, IMP_PROP_VECTOR, value, 3);
    return imp__calls_outcome(scene);
}

enum imp_status imp_scene_rgb(imp_scene *scene, const char *name, const double value[3])
{
    numbers(scene, name, IMP_PROP_RGB, value, 3);
    return imp__calls_outcome(scene);
}

enum imp_status imp_scene_transform(imp_scene *scene, const char *name,
                                    const double value[16])
{
    numbers(scene, name, IMP_PROP_TRANSFORM, value, 16);
    return imp__calls_outcome(scene);
}

enum imp_status imp_scene_string(imp_scene *scene, const char *name, const char *value)
{
    struct imp_prop *p = prop(scene, name, IMP_PROP_STRING);
    if (!p) return imp__calls_outcome(scene);
    if (!value) {
        imp__calls_keep(scene, imp__error(scene->ctx, IMP_E_ARG,
                                          "scene: value of '%s' is NULL", name));
        return imp__calls_outcome(scene);
    }
    p->string = imp__arena_strdup(&scene->arena, value);
    if (!p->string)
        imp__calls_keep(scene,
                        imp__error(scene->ctx, IMP_E_NOMEM, "scene: out of memory"));
    return imp__calls_outcome(scene);
}

static enum imp_status spectrum(struct imp_scene *scene, struct imp_prop *p, size_t n,
                                const double *nm, const double *values)
{
    imp_context *ctx = scene->ctx;
    if (!nm || !values)
        return imp__error(ctx, IMP_E_ARG, "scene: %s of spectrum '%s' is NULL",
                          nm ? "values" : "wavelengths_nm", p->name);
    if (n > SIZE_MAX / 64)
        return imp__error(ctx, IMP_E_ARG, "scene: spectrum '%s' has %zu samples", p->name,
                          n);
    double *list = imp__arena_array(&scene->arena, n, 2 * sizeof *list);
    if (!list) return imp__error(ctx, IMP_E_NOMEM, "scene: out of memory");
    if (n) memcpy(list, nm, n * sizeof *list);
    if (n) memcpy(list + n, values, n * sizeof *list);
    const enum imp_status st = imp__samples_check(ctx, &(struct imp_samples){n, list});
    if (st != IMP_OK)
        return imp__error_prefix(ctx, IMP_E_ARG, "scene: spectrum '%s'", p->name);
    p->list = list;
    p->n = n;
    return IMP_OK;
}

enum imp_status imp_scene_spectrum(imp_scene *scene, const char *name, size_t n,
                                   const double *wavelengths_nm, const double *values)
{
    if (n == 1 && !wavelengths_nm) {
        numbers(scene, name, IMP_PROP_UNIFORM, values, 1);
        return imp__calls_outcome(scene);
    }
    struct imp_prop *p = prop(scene, name, IMP_PROP_SPECTRUM);
    if (p) imp__calls_keep(scene, spectrum(scene, p, n, wavelengths_nm, values));
    return imp__calls_outcome(scene);
}

enum imp_status imp_scene_ref(imp_scene *scene, const char *id, const char *name)
{
    if (!imp__calls_ready(scene)) return imp__calls_outcome(scene);
    if (!id)
        imp__calls_keep(scene,
                        imp__error(scene->ctx, IMP_E_ARG, "imp_scene_ref: id is NULL"));
    else
        imp__calls_keep(
            scene, imp__tree_ref(scene->tree, imp__calls_top(scene), id, name, nowhere));
    return imp__calls_outcome(scene);
}

/* ---- Commit -------------------------------------------------------------------- */

enum imp_status imp_scene_commit(imp_scene *scene)
{
    IMP_REQUIRE(NULL, scene, "scene");
    IMP_FLOAT_MODE;
    imp_context *ctx = scene->ctx;
    if (scene->build_status != IMP_OK) return failed_before(scene);
    if (!scene->tree) return imp__error(ctx, IMP_E_ARG, "scene: it is committed already");
    enum imp_status st = IMP_OK;
    if (scene->n_stack > 1)
        IMP_TRY(
            imp__node_error(ctx, imp__calls_top(scene), IMP_E_ARG, "begin without end"));
    IMP_TRY(imp__tree_resolve(scene->tree));
    IMP_TRY(imp__scene_finish(scene));
    imp__tree_free(scene->tree); /* early: empty when the scene ends */
    scene->tree = NULL;
out:
    imp__calls_keep(scene, st);
    return st;
}
