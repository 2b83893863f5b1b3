/* SPDX-License-Identifier: Apache-2.0
 *
 * Nodes that name files get what the files hold: triangles for obj,
 * ply and serialized, pixels for
 * bitmap and envmap, intensities for ies, reflectances for merl and measured, cells for gridvolume,
 * control points for curves. */
#include "base/film.h"
#include "base/required.h"
#include "color/rgb.h"
#include "curve_file.h"
#include "ies_file.h"
#include "image.h"
#include "ldt_file.h"
#include "load.h"
#include "measured_file.h"
#include "merl_file.h"
#include "mesh_file.h"
#include "search.h"
#include "vol_file.h"
#include <string.h>

/* The message that is there, with the place of the property and the object before it. */
static enum imp_status placed(struct imp_scene *scene, const struct imp_node *node,
                              enum imp_status st)
{
    const struct imp_prop *p = imp__node_prop(node, "filename");
    return imp__prop_error(scene->ctx, node, p, st, "%s", imp_last_error(scene->ctx));
}

/* The file a node names. Files named in an included file are searched in its folder
 * first. */
static enum imp_status path_of(struct imp_scene *scene, struct imp_node *node,
                               const char **out)
{
    const char *name, *first = NULL;
    enum imp_status st = imp__props_string(scene->ctx, node, "filename", NULL, &name);
    if (st != IMP_OK) return st;
    if (!name) return imp__node_missing(scene->ctx, node, "filename");
    const char *file = imp__node_prop(node, "filename")->loc.file;
    if (file && file != scene->root->loc.file) {
        first = imp__folder_of(scene, file);
        if (!first) return imp__error(scene->ctx, IMP_E_NOMEM, "scene: out of memory");
    }
    st = imp__search(scene, first, name, out);
    if (st != IMP_OK) imp__error_prefix(scene->ctx, st, "filename");
    return st == IMP_OK ? st : placed(scene, node, st);
}

/* Attributes of a mesh are textures in its shape, unless the scene has put others there. */
static enum imp_status attributes_attach(struct imp_scene *scene, struct imp_node *node,
                                         const struct imp_mesh_data *data)
{
    for (int k = 0; k < data->n_attributes; k++) {
        const struct imp_attribute_data *a = &data->attribute[k];
        if (imp__node_child(node, a->name)) continue;
        struct imp_node *t = imp__node_create(&scene->arena, "texture", "attribute", NULL,
                                              NULL, node->loc);
        if (!t || !imp__node_add_child(&scene->arena, node, t, a->name, t->loc))
            return imp__error(scene->ctx, IMP_E_NOMEM, "scene: out of memory");
        t->attribute = a;
    }
    return IMP_OK;
}

static enum imp_status mesh_attach(struct imp_scene *scene, struct imp_node *node)
{
    enum imp_status st = IMP_OK;
    imp_context *ctx = scene->ctx;
    const bool obj = strcmp(node->type, "obj") == 0, ply = strcmp(node->type, "ply") == 0;
    int64_t index = 0;
    struct imp_mesh_source source = {
        .ctx = ctx, .keep = &scene->arena, .temporary = &scene->files};
    struct imp_mesh_data *data = imp__arena_array(&scene->files, 1, sizeof *data);
    if (!data) IMP_TRY(imp__error(ctx, IMP_E_NOMEM, "scene: out of memory"));
    IMP_TRY(imp__props_bool(ctx, node, "flip_tex_coords", obj, &source.flip_v));
    if (!obj && !ply)
        IMP_TRY(imp__props_int(ctx, node, "shape_index", 0, 0, INT32_MAX, &index));
    IMP_TRY(path_of(scene, node, &source.name));
    st = imp__file_read(ctx, source.name, IMP_MESH_BYTES_MAX, &source.text);
    if (st == IMP_OK)
        st = obj   ? imp__obj_parse(&source, data)
             : ply ? imp__ply_parse(&source, data)
                   : imp__serialized_parse(&source, (int)index, data);
    if (st != IMP_OK) IMP_TRY(placed(scene, node, st));
    node->mesh = data;
    IMP_TRY(attributes_attach(scene, node, data));
out:
    imp__bytes_free(ctx, &source.text);
    return st;
}

/* The one or three channels that make a picture, side by side. */
static enum imp_status pixels_copy(struct imp_scene *scene, const imp_film *f, bool srgb,
                                   const char *path, struct imp_image_data *out)
{
    imp_context *ctx = scene->ctx;
    const struct imp_pick pick = imp__image_pick(f);
    if (!pick.n)
        return imp__error(ctx, IMP_E_SCENE, "%s: has no channels R, G, B or Y", path);
    const size_t n = (size_t)f->width * (size_t)f->height;
    float *pixels = imp__arena_take(&scene->files, n, (size_t)pick.n * sizeof *pixels);
    if (!pixels)
        return imp__error(ctx, IMP_E_NOMEM, "%s: no memory for the picture", path);
    float *to = pixels;
    for (size_t i = 0; i < n; i++, to += pick.n) {
        const float *from = f->mean + i * (size_t)f->channels;
        for (int k = 0; k < pick.n; k++) to[k] = from[pick.channel[k]];
        if (pick.xyz) {
            double rgb[3];
            imp__xyz_to_rgb((double[3]){to[0], to[1], to[2]}, rgb);
            for (int k = 0; k < 3; k++) to[k] = (float)rgb[k];
        }
    }
    *out = (struct imp_image_data){f->width, f->height, pick.n, pixels, srgb};
    return IMP_OK;
}

static enum imp_status image_attach(struct imp_scene *scene, struct imp_node *node)
{
    enum imp_status st = IMP_OK;
    imp_context *ctx = scene->ctx;
    imp_film *film = NULL;
    const char *path;
    bool srgb;
    struct imp_image_data *data = imp__arena_array(&scene->files, 1, sizeof *data);
    if (!data) IMP_TRY(imp__error(ctx, IMP_E_NOMEM, "scene: out of memory"));
    IMP_TRY(path_of(scene, node, &path));
    st = imp__image_read(ctx, path, &film, &srgb);
    if (st == IMP_OK) st = pixels_copy(scene, film, srgb, path, data);
    if (st != IMP_OK) IMP_TRY(placed(scene, node, st));
    node->image = data;
out:
    imp_film_destroy(film);
    return st;
}

/* The file that TILT= of the LM-63 file at `path` names, from the folder of that. */
static enum imp_status tilt_attach(struct imp_scene *scene, struct imp_node *node,
                                   const char *path, struct imp_ies_data *data)
{
    enum imp_status st = IMP_OK;
    struct imp_bytes text = {0};
    const char *tilt, *first = imp__folder_of(scene, path);
    if (!first) IMP_TRY(imp__error(scene->ctx, IMP_E_NOMEM, "scene: out of memory"));
    st = imp__search(scene, first, data->tilt_file, &tilt);
    if (st != IMP_OK) imp__error_prefix(scene->ctx, st, "%s: TILT", path);
    if (st == IMP_OK) st = imp__file_read(scene->ctx, tilt, IMP_IES_BYTES_MAX, &text);
    if (st == IMP_OK)
        st = imp__ies_tilt_parse(scene->ctx, &scene->arena, tilt, &text, data);
    if (st != IMP_OK) st = placed(scene, node, st);
out:
    imp__bytes_free(scene->ctx, &text);
    return st;
}

static enum imp_status ies_attach(struct imp_scene *scene, struct imp_node *node)
{
    enum imp_status st = IMP_OK;
    imp_context *ctx = scene->ctx;
    struct imp_bytes text = {0};
    const char *path;
    struct imp_ies_data *data = imp__arena_array(&scene->arena, 1, sizeof *data);
    if (!data) IMP_TRY(imp__error(ctx, IMP_E_NOMEM, "scene: out of memory"));
    IMP_TRY(path_of(scene, node, &path));
    st = imp__file_read(ctx, path, IMP_IES_BYTES_MAX, &text);
    const bool eulumdat =
        strlen(path) > 4 && strcasecmp(path + strlen(path) - 4, ".ldt") == 0;
    if (st == IMP_OK)
        st = eulumdat ? imp__ldt_parse(ctx, &scene->arena, path, &text, data)
                      : imp__ies_parse(ctx, &scene->arena, path, &text, data);
    if (st != IMP_OK) IMP_TRY(placed(scene, node, st));
    if (data->tilt_file) IMP_TRY(tilt_attach(scene, node, path, data));
    node->ies = data;
out:
    imp__bytes_free(ctx, &text);
    return st;
}

/* The picture of an environment is a bitmap in its slot data, whether it was written as
 * `filename`, given by pixels, or nested under any name. */
static enum imp_status sky_expand(struct imp_scene *scene, struct imp_node *node)
{
    struct imp_prop *file = imp__node_prop(node, "filename");
    struct imp_child *picture = NULL;
    for (size_t i = 0; i < node->n_children && !picture; i++)
        if (node->children[i].node && strcmp(node->children[i].node->tag, "texture") == 0)
            picture = &node->children[i];
    if ((file != NULL) + (picture != NULL) + (node->image != NULL) > 1)
        return imp__node_error(scene->ctx, node, IMP_E_SCENE,
                               "has two pictures: one of 'filename', a bitmap or pixels "
                               "can be");
    if (picture) picture->name = "data";
    if (picture || (!file && !node->image)) return IMP_OK;
    struct imp_node *t = imp__node_create(&scene->arena, "texture", "bitmap", NULL, NULL,
                                          file ? file->loc : node->loc);
    if (!t || !imp__node_add_child(&scene->arena, node, t, "data", t->loc))
        return imp__error(scene->ctx, IMP_E_NOMEM, "scene: out of memory");
    t->image = node->image;
    if (!file) return IMP_OK;
    struct imp_prop *p =
        imp__node_add(&scene->arena, t, "filename", file->type, file->loc);
    if (!p) return imp__error(scene->ctx, IMP_E_NOMEM, "scene: out of memory");
    *p = *file;
    return IMP_OK;
}

static enum imp_status merl_attach(struct imp_scene *scene, struct imp_node *node)
{
    enum imp_status st = IMP_OK;
    imp_context *ctx = scene->ctx;
    struct imp_bytes file = {0};
    const char *path;
    struct imp_merl_data *data = imp__arena_array(&scene->arena, 1, sizeof *data);
    if (!data) IMP_TRY(imp__error(ctx, IMP_E_NOMEM, "scene: out of memory"));
    IMP_TRY(path_of(scene, node, &path));
    st = imp__file_read(ctx, path, IMP_MERL_BYTES_MAX, &file);
    if (st == IMP_OK) st = imp__merl_parse(ctx, &scene->arena, path, &file, data);
    if (st != IMP_OK) IMP_TRY(placed(scene, node, st));
    node->merl = data;
out:
    imp__bytes_free(ctx, &file);
    return st;
}

static enum imp_status measured_attach(struct imp_scene *scene, struct imp_node *node)
{
    enum imp_status st = IMP_OK;
    imp_context *ctx = scene->ctx;
    struct imp_bytes file = {0};
    const char *path;
    struct imp_measured_data *data = imp__arena_array(&scene->arena, 1, sizeof *data);
    if (!data) IMP_TRY(imp__error(ctx, IMP_E_NOMEM, "scene: out of memory"));
    IMP_TRY(path_of(scene, node, &path));
    st = imp__file_read(ctx, path, IMP_TENSOR_BYTES_MAX, &file);
    if (st == IMP_OK) st = imp__measured_parse(ctx, &scene->arena, path, &file, data);
    if (st != IMP_OK) IMP_TRY(placed(scene, node, st));
    node->measured = data;
out:
    imp__bytes_free(ctx, &file);
    return st;
}

static enum imp_status curves_attach(struct imp_scene *scene, struct imp_node *node)
{
    enum imp_status st = IMP_OK;
    imp_context *ctx = scene->ctx;
    struct imp_bytes text = {0};
    const char *path;
    struct imp_curve_data *data = imp__arena_array(&scene->files, 1, sizeof *data);
    if (!data) IMP_TRY(imp__error(ctx, IMP_E_NOMEM, "scene: out of memory"));
    IMP_TRY(path_of(scene, node, &path));
    st = imp__file_read(ctx, path, IMP_CURVE_BYTES_MAX, &text);
    if (st == IMP_OK) st = imp__curve_parse(ctx, &scene->files, path, &text, data);
    if (st != IMP_OK) IMP_TRY(placed(scene, node, st));
    node->curves = data;
out:
    imp__bytes_free(ctx, &text);
    return st;
}

static enum imp_status grid_attach(struct imp_scene *scene, struct imp_node *node)
{
    enum imp_status st = IMP_OK;
    imp_context *ctx = scene->ctx;
    struct imp_bytes bytes = {0};
    const char *path;
    struct imp_grid_data *data = imp__arena_array(&scene->files, 1, sizeof *data);
    if (!data) IMP_TRY(imp__error(ctx, IMP_E_NOMEM, "scene: out of memory"));
    IMP_TRY(path_of(scene, node, &path));
    st = imp__file_read(ctx, path, IMP_VOL_BYTES_MAX, &bytes);
    if (st == IMP_OK) st = imp__vol_parse(ctx, &scene->files, path, &bytes, data);
    if (st != IMP_OK) IMP_TRY(placed(scene, node, st));
    node->grid = data;
out:
    imp__bytes_free(ctx, &bytes);
    return st;
}

static enum imp_status attach(struct imp_scene *scene, struct imp_node *node)
{
    enum imp_status st = IMP_OK;
    const bool shape = strcmp(node->tag, "shape") == 0,
               mesh = shape &&
                      (strcmp(node->type, "obj") == 0 || strcmp(node->type, "ply") == 0 ||
                       strcmp(node->type, "serialized") == 0),
               bitmap =
                   strcmp(node->tag, "texture") == 0 && strcmp(node->type, "bitmap") == 0;
    if (mesh) IMP_TRY(mesh_attach(scene, node));
    if (shape && !node->curves &&
        (strcmp(node->type, "bsplinecurve") == 0 ||
         strcmp(node->type, "linearcurve") == 0))
        IMP_TRY(curves_attach(scene, node));
    if (strcmp(node->tag, "medium") == 0 && strcmp(node->type, "graded") == 0)
        IMP_TRY(imp__graded_attach(scene, node));
    if (strcmp(node->tag, "emitter") == 0 && strcmp(node->type, "ies") == 0 && !node->ies)
        IMP_TRY(ies_attach(scene, node));
    if (strcmp(node->tag, "bsdf") == 0 && strcmp(node->type, "merl") == 0 && !node->merl)
        IMP_TRY(merl_attach(scene, node));
    if (strcmp(node->tag, "bsdf") == 0 && strcmp(node->type, "measured") == 0 &&
        !node->measured)
        IMP_TRY(measured_attach(scene, node));
    if (strcmp(node->tag, "emitter") == 0 && strcmp(node->type, "envmap") == 0)
        IMP_TRY(sky_expand(scene, node));
    if (strcmp(node->tag, "volume") == 0 && strcmp(node->type, "gridvolume") == 0) {
        if (!node->grid) IMP_TRY(grid_attach(scene, node));
        else if (imp__node_prop(node, "filename"))
            IMP_TRY(imp__node_error(scene->ctx, node, IMP_E_SCENE,
                                    "has cells and a 'filename': only one can be"));
    }
    if (bitmap && !node->image) IMP_TRY(image_attach(scene, node));
    else if (bitmap && imp__node_prop(node, "filename"))
        IMP_TRY(imp__node_error(scene->ctx, node, IMP_E_SCENE,
                                "has pixels and a 'filename': only one can be"));
    for (size_t i = 0; i < node->n_children; i++)
        if (!node->children[i].ref) IMP_TRY(attach(scene, node->children[i].node));
out:
    return st;
}

enum imp_status imp__files_attach(struct imp_scene *scene)
{
    return attach(scene, scene->root);
}
