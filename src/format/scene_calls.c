/* SPDX-License-Identifier: Apache-2.0
 *
 * Scenes built by calls: the same tree that the XML reader makes. The first failure is
 * kept; later calls do nothing, and return it as commit does. */
#include "base/arguments.h"
#include "base/film.h"
#include "load.h"
#include "mesh_file.h"
#include "search.h"
#include "tree.h"
#include "value.h"
#include "vol_file.h"
#include <math.h>
#include <stdio.h>
#include <string.h>

static const struct imp_loc nowhere = {NULL, 0, 0};

static enum imp_status failed_before(const struct imp_scene *scene)
{
    return imp__error(scene->ctx, scene->build_status, "%s",
                      scene->build_error ? scene->build_error : "scene: out of memory");
}

/* May the build go on? If not, the message is that of the first failure. */
static bool ready(struct imp_scene *scene)
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

static void keep(struct imp_scene *scene, enum imp_status st)
{
    if (st == IMP_OK) return;
    scene->build_status = st;
    scene->build_error = imp__strdup(scene->ctx, imp_last_error(scene->ctx));
}

/* What a call of a build returns: its own failure, or the first one before it. */
static enum imp_status outcome(const struct imp_scene *scene)
{
    if (!scene) return IMP_E_ARG;
    if (scene->build_status != IMP_OK) return scene->build_status;
    return scene->tree ? IMP_OK : IMP_E_ARG; /* it is committed */
}

static struct imp_node *top(const struct imp_scene *scene)
{
    return scene->stack[scene->n_stack - 1];
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
    const enum imp_status st =
        imp__tree_open(scene->tree, top(scene), tag, type, id, name, nowhere, &node);
    return st == IMP_OK ? push(scene, node) : st;
}

enum imp_status imp_scene_begin(imp_scene *scene, const char *tag, const char *type,
                                const char *id, const char *name)
{
    if (ready(scene)) keep(scene, begin(scene, tag, type, id, name));
    return outcome(scene);
}

enum imp_status imp_scene_end(imp_scene *scene)
{
    if (!ready(scene)) return outcome(scene);
    if (scene->n_stack == 1)
        keep(scene, imp__error(scene->ctx, IMP_E_ARG, "scene: end without begin"));
    else scene->n_stack--;
    return outcome(scene);
}

/* ---- Properties ---------------------------------------------------------------- */

/* A new property of the open object; NULL: the build has failed. */
static struct imp_prop *prop(struct imp_scene *scene, const char *name,
                             enum imp_prop_type type)
{
    struct imp_prop *p = NULL;
    if (!ready(scene)) return NULL;
    if (!name)
        keep(scene,
             imp__error(scene->ctx, IMP_E_ARG, "scene: a property's name is NULL"));
    else keep(scene, imp__tree_prop(scene->tree, top(scene), name, type, nowhere, &p));
    return scene->build_status == IMP_OK ? p : NULL;
}

static void numbers(struct imp_scene *scene, const char *name, enum imp_prop_type type,
                    const double *value, int n)
{
    struct imp_prop *p = prop(scene, name, type);
    if (!p) return;
    if (!value)
        keep(scene, imp__error(scene->ctx, IMP_E_ARG, "scene: value of %s '%s' is NULL",
                               top(scene)->tag, name));
    for (int i = 0; value && i < n; i++) {
        if (!isfinite(value[i])) {
            keep(scene, imp__error(scene->ctx, IMP_E_ARG, "scene: value of %s '%s' is %g",
                                   top(scene)->tag, name, value[i]));
            return;
        }
        p->number[i] = value[i];
    }
}

enum imp_status imp_scene_bool(imp_scene *scene, const char *name, bool value)
{
    struct imp_prop *p = prop(scene, name, IMP_PROP_BOOL);
    if (p) p->integer = value;
    return outcome(scene);
}

enum imp_status imp_scene_integer(imp_scene *scene, const char *name, int64_t value)
{
    struct imp_prop *p = prop(scene, name, IMP_PROP_INTEGER);
    if (p) p->integer = value;
    return outcome(scene);
}

enum imp_status imp_scene_float(imp_scene *scene, const char *name, double value)
{
    numbers(scene, name, IMP_PROP_FLOAT, &value, 1);
    return outcome(scene);
}

enum imp_status imp_scene_vector(imp_scene *scene, const char *name,
                                 const double value[3])
{
    numbers(scene, name, IMP_PROP_VECTOR, value, 3);
    return outcome(scene);
}

enum imp_status imp_scene_rgb(imp_scene *scene, const char *name, const double value[3])
{
    numbers(scene, name, IMP_PROP_RGB, value, 3);
    return outcome(scene);
}

enum imp_status imp_scene_transform(imp_scene *scene, const char *name,
                                    const double value[16])
{
    numbers(scene, name, IMP_PROP_TRANSFORM, value, 16);
    return outcome(scene);
}

enum imp_status imp_scene_string(imp_scene *scene, const char *name, const char *value)
{
    struct imp_prop *p = prop(scene, name, IMP_PROP_STRING);
    if (!p) return outcome(scene);
    if (!value) {
        keep(scene,
             imp__error(scene->ctx, IMP_E_ARG, "scene: value of '%s' is NULL", name));
        return outcome(scene);
    }
    p->string = imp__arena_strdup(&scene->arena, value);
    if (!p->string)
        keep(scene, imp__error(scene->ctx, IMP_E_NOMEM, "scene: out of memory"));
    return outcome(scene);
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
        return outcome(scene);
    }
    struct imp_prop *p = prop(scene, name, IMP_PROP_SPECTRUM);
    if (p) keep(scene, spectrum(scene, p, n, wavelengths_nm, values));
    return outcome(scene);
}

enum imp_status imp_scene_ref(imp_scene *scene, const char *id, const char *name)
{
    if (!ready(scene)) return outcome(scene);
    if (!id) keep(scene, imp__error(scene->ctx, IMP_E_ARG, "imp_scene_ref: id is NULL"));
    else keep(scene, imp__tree_ref(scene->tree, top(scene), id, name, nowhere));
    return outcome(scene);
}

/* ---- Bulk data ----------------------------------------------------------------- */

static bool open_is(const struct imp_scene *scene, const char *tag, const char *type)
{
    return strcmp(top(scene)->tag, tag) == 0 && strcmp(top(scene)->type, type) == 0;
}

static enum imp_status floats_check(imp_context *ctx, const struct imp_node *node,
                                    const char *name, const float *values, size_t n)
{
    for (size_t i = 0; i < n; i++)
        if (!isfinite(values[i]))
            return imp__node_error(ctx, node, IMP_E_ARG, "%s[%zu] is %g", name, i,
                                   (double)values[i]);
    return IMP_OK;
}

static enum imp_status mesh(struct imp_scene *scene, size_t n_vertices,
                            size_t n_triangles, const float *positions,
                            const float *normals, const float *uvs,
                            const uint32_t *indices)
{
    imp_context *ctx = scene->ctx;
    struct imp_node *node = top(scene);
    if (!open_is(scene, "shape", "mesh") || node->mesh)
        return imp__node_error(ctx, node, IMP_E_ARG,
                               "triangles are for a shape of type 'mesh', once");
    if (!positions || !indices)
        return imp__node_error(ctx, node, IMP_E_ARG, "%s is NULL",
                               positions ? "indices" : "positions");
    if (n_vertices < 1 || n_triangles < 1 || n_vertices > IMP_MESH_MAX ||
        n_triangles > IMP_MESH_MAX)
        return imp__node_error(ctx, node, IMP_E_ARG,
                               "needs between 1 and 2^31 vertices and triangles");
    IMP_CHECKED(floats_check(ctx, node, "positions", positions, 3 * n_vertices));
    if (normals) IMP_CHECKED(floats_check(ctx, node, "normals", normals, 3 * n_vertices));
    if (uvs) IMP_CHECKED(floats_check(ctx, node, "uvs", uvs, 2 * n_vertices));
    const struct imp_mesh_source source = {
        .ctx = ctx, .keep = &scene->arena, .temporary = &scene->files, .name = "mesh"};
    struct imp_mesh_data *data = imp__arena_array(&scene->files, 1, sizeof *data);
    float *p, *n, *uv;
    uint32_t *i;
    if (!data) return imp__error(ctx, IMP_E_NOMEM, "scene: out of memory");
    const enum imp_status st =
        imp__mesh_arrays(&source, n_vertices, n_triangles, &p, normals ? &n : NULL,
                         uvs ? &uv : NULL, &i, data);
    if (st != IMP_OK) return st;
    memcpy(p, positions, 3 * n_vertices * sizeof *p);
    if (normals) memcpy(n, normals, 3 * n_vertices * sizeof *n);
    if (uvs) memcpy(uv, uvs, 2 * n_vertices * sizeof *uv);
    memcpy(i, indices, 3 * n_triangles * sizeof *i);
    node->mesh = data;
    return IMP_OK;
}

enum imp_status imp_scene_mesh(imp_scene *scene, size_t n_vertices, size_t n_triangles,
                               const float *positions, const float *normals,
                               const float *uvs, const uint32_t *indices)
{
    if (ready(scene))
        keep(scene,
             mesh(scene, n_vertices, n_triangles, positions, normals, uvs, indices));
    return outcome(scene);
}

static enum imp_status image(struct imp_scene *scene, int width, int height, int channels,
                             const float *pixels)
{
    imp_context *ctx = scene->ctx;
    struct imp_node *node = top(scene);
    if ((!open_is(scene, "texture", "bitmap") && !open_is(scene, "emitter", "envmap")) ||
        node->image)
        return imp__node_error(ctx, node, IMP_E_ARG,
                               "pixels are for a texture of type 'bitmap' or an emitter "
                               "of type 'envmap', once");
    if (!pixels) return imp__node_error(ctx, node, IMP_E_ARG, "pixels is NULL");
    if (width < 1 || height < 1 || width > IMP_FILM_SIDE_MAX ||
        height > IMP_FILM_SIDE_MAX || (channels != 1 && channels != 3))
        return imp__node_error(ctx, node, IMP_E_ARG,
                               "a picture of %d x %d with %d channels", width, height,
                               channels);
    const size_t n = (size_t)width * (size_t)height * (size_t)channels;
    IMP_CHECKED(floats_check(ctx, node, "pixels", pixels, n));
    struct imp_image_data *data = imp__arena_array(&scene->files, 1, sizeof *data);
    float *copy = data ? imp__arena_take(&scene->files, n, sizeof *copy) : NULL;
    if (!copy) return imp__error(ctx, IMP_E_NOMEM, "scene: no memory for a picture");
    memcpy(copy, pixels, n * sizeof *copy);
    *data = (struct imp_image_data){width, height, channels, copy, false};
    node->image = data;
    return IMP_OK;
}

enum imp_status imp_scene_image(imp_scene *scene, int width, int height, int channels,
                                const float *pixels)
{
    if (ready(scene)) keep(scene, image(scene, width, height, channels, pixels));
    return outcome(scene);
}

static enum imp_status grid(struct imp_scene *scene, const int n[3], int channels,
                            const float *values)
{
    imp_context *ctx = scene->ctx;
    struct imp_node *node = top(scene);
    if (!open_is(scene, "volume", "gridvolume") || node->grid)
        return imp__node_error(ctx, node, IMP_E_ARG,
                               "cells are for a volume of type 'gridvolume', once");
    if (!values) return imp__node_error(ctx, node, IMP_E_ARG, "values is NULL");
    size_t cells = 1;
    for (int k = 0; k < 3; k++)
        if (n[k] < 1 || __builtin_mul_overflow(cells, (size_t)n[k], &cells) ||
            cells > IMP_VOL_BYTES_MAX / (3 * sizeof(float)))
            return imp__node_error(ctx, node, IMP_E_ARG, "a grid of %d x %d x %d cells",
                                   n[0], n[1], n[2]);
    if (channels != 1 && channels != 3)
        return imp__node_error(ctx, node, IMP_E_ARG,
                               "a grid with %d channels; 1 or 3 are possible", channels);
    const size_t count = cells * (size_t)channels;
    IMP_CHECKED(floats_check(ctx, node, "values", values, count));
    struct imp_grid_data *data = imp__arena_array(&scene->files, 1, sizeof *data);
    float *copy = data ? imp__arena_take(&scene->files, count, sizeof *copy) : NULL;
    if (!copy) return imp__error(ctx, IMP_E_NOMEM, "scene: no memory for a grid");
    memcpy(copy, values, count * sizeof *copy);
    *data =
        (struct imp_grid_data){{n[0], n[1], n[2]}, channels, {0, 0, 0, 1, 1, 1}, copy};
    node->grid = data;
    return IMP_OK;
}

enum imp_status imp_scene_grid(imp_scene *scene, int nx, int ny, int nz, int channels,
                               const float *values)
{
    if (ready(scene))
        keep(scene, grid(scene, (const int[3]){nx, ny, nz}, channels, values));
    return outcome(scene);
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
        IMP_TRY(imp__node_error(ctx, top(scene), IMP_E_ARG, "begin without end"));
    IMP_TRY(imp__tree_resolve(scene->tree));
    IMP_TRY(imp__scene_finish(scene));
    imp__tree_free(scene->tree); /* early: empty when the scene ends */
    scene->tree = NULL;
out:
    keep(scene, st);
    return st;
}
