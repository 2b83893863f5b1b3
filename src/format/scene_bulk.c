/* SPDX-License-Identifier: Apache-2.0
 *
 * Scenes built by calls: triangles, pixels and cells, which are copied. */
#include "base/arguments.h"
#include "base/film.h"
#include "mesh_file.h"
#include "scene_calls.h"
#include "vol_file.h"
#include <math.h>
#include <string.h>

static bool open_is(const struct imp_scene *scene, const char *tag, const char *type)
{
    return strcmp(imp__calls_top(scene)->tag, tag) == 0 &&
           strcmp(imp__calls_top(scene)->type, type) == 0;
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
    struct imp_node *node = imp__calls_top(scene);
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
    if (imp__calls_ready(scene))
        imp__calls_keep(scene, mesh(scene, n_vertices, n_triangles, positions, normals,
                                    uvs, indices));
    return imp__calls_outcome(scene);
}

static enum imp_status image(struct imp_scene *scene, int width, int height, int channels,
                             const float *pixels)
{
    imp_context *ctx = scene->ctx;
    struct imp_node *node = imp__calls_top(scene);
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
    if (imp__calls_ready(scene))
        imp__calls_keep(scene, image(scene, width, height, channels, pixels));
    return imp__calls_outcome(scene);
}

static enum imp_status grid(struct imp_scene *scene, const int n[3], int channels,
                            const float *values)
{
    imp_context *ctx = scene->ctx;
    struct imp_node *node = imp__calls_top(scene);
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
    if (imp__calls_ready(scene))
        imp__calls_keep(scene, grid(scene, (const int[3]){nx, ny, nz}, channels, values));
    return imp__calls_outcome(scene);
}
