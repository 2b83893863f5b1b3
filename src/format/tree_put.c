/* SPDX-License-Identifier: Apache-2.0
 *
 * Writes a committed scene as building calls (tree_marks.h); texels have their present values, and
 * a mesh whose triangles are not needed is one triangle across its bounds. */
#include "kind/bsdf/measured.h"
#include "scene/instances.h"
#include "scene/scene_build.h"
#include "tree_file.h"
#include "tree_marks.h"
#include <string.h>

struct putting {
    const struct imp_scene *scene;
    const double *theta;
    struct imp_bytes *out;
    bool full; /* out of memory */
};

static void put(struct putting *p, const void *data, size_t n)
{
    if (!p->full) p->full = !imp__bytes_add(p->scene->ctx, p->out, data, n);
}
static void put_mark(struct putting *p, enum imp__tree_mark mark)
{
    const uint8_t byte = (uint8_t)mark;
    put(p, &byte, 1);
}
static void put_count(struct putting *p, size_t n)
{
    const uint64_t count = n;
    put(p, &count, sizeof count);
}
static void put_text(struct putting *p, const char *text)
{
    const uint32_t n = text ? (uint32_t)strlen(text) : UINT32_MAX;
    put(p, &n, sizeof n);
    if (text) put(p, text, n);
}

static void put_number(struct putting *p, const struct imp_prop *prop,
                       enum imp__tree_mark mark, size_t n)
{
    put_mark(p, mark);
    put_text(p, prop->name);
    put(p, prop->number, n * sizeof *prop->number);
}

static enum imp_status prop_put(struct putting *p, const struct imp_node *node,
                                const struct imp_prop *prop)
{
    const uint8_t yes = prop->integer != 0;
    switch (prop->type) {
    case IMP_PROP_BOOL:
        put_mark(p, MARK_BOOL);
        put_text(p, prop->name);
        put(p, &yes, 1);
        break;
    case IMP_PROP_INTEGER:
        put_mark(p, MARK_INTEGER);
        put_text(p, prop->name);
        put(p, &prop->integer, sizeof prop->integer);
        break;
    case IMP_PROP_STRING:
        put_mark(p, MARK_STRING);
        put_text(p, prop->name);
        put_text(p, prop->string);
        break;
    case IMP_PROP_FLOAT: put_number(p, prop, MARK_FLOAT, 1); break;
    case IMP_PROP_VECTOR: put_number(p, prop, MARK_VECTOR, 3); break;
    case IMP_PROP_RGB: put_number(p, prop, MARK_RGB, 3); break;
    case IMP_PROP_TRANSFORM: put_number(p, prop, MARK_TRANSFORM, 16); break;
    case IMP_PROP_UNIFORM:
    case IMP_PROP_SPECTRUM:
        put_mark(p, MARK_SPECTRUM);
        put_text(p, prop->name);
        put_count(p, prop->type == IMP_PROP_UNIFORM ? 0 : prop->n);
        if (prop->type == IMP_PROP_UNIFORM) put(p, prop->number, sizeof *prop->number);
        else put(p, prop->list, 2 * prop->n * sizeof *prop->list);
        break;
    case IMP_PROP_REF:
        return imp__prop_error(p->scene->ctx, node, prop, IMP_E_UNSUPPORTED,
                               "this reference is not written with recorded walks");
    }
    return IMP_OK;
}

/* Texels of a picture or cells of a grid, as they were when walks were drawn. */
static void texels_put(struct putting *p, const struct imp_param *param)
{
    for (size_t e = 0; e < param->info.count; e++) {
        const float x = (float)p->theta[param->info.offset + e];
        put(p, &x, sizeof x);
    }
}

static const struct imp_param *texels_of(const struct imp_scene *scene,
                                         const struct imp_node *node)
{
    const struct imp_texture *t = node->object;
    const struct imp_param *param = t && t->param >= 0 ? &scene->params[t->param] : NULL;
    return param && param->store == IMP_STORE_BULK ? param : NULL;
}

static void image_put(struct putting *p, const struct imp_node *node)
{
    const struct imp_param *param = texels_of(p->scene, node);
    const float black = 0;
    int32_t size[3] = {1, 1, 1}; /* of one that nothing is made of */
    if (param) {
        size[0] = (int32_t)param->info.dims[1];
        size[1] = (int32_t)param->info.dims[0];
        size[2] = (int32_t)param->info.dims[2];
    }
    put_mark(p, MARK_IMAGE);
    put(p, size, sizeof size);
    if (param) texels_put(p, param);
    else put(p, &black, sizeof black);
}

static enum imp_status grid_put(struct putting *p, const struct imp_node *node)
{
    const struct imp_param *param = texels_of(p->scene, node);
    if (!param)
        return imp__node_error(p->scene->ctx, node, IMP_E_UNSUPPORTED,
                               "its cells are no parameter, and not written with kept "
                               "walks");
    const struct imp_param_info *info = &param->info;
    const bool colour = info->flags & IMP_PARAM_COLOR;
    const int32_t size[4] = {
        (int32_t)(colour ? info->dims[1] : info->dims[2]),
        (int32_t)(colour ? info->dims[0] / info->layers : info->dims[1]),
        (int32_t)info->layers, colour ? 3 : 1};
    put_mark(p, MARK_GRID);
    put(p, size, sizeof size);
    put(p, param->box, sizeof param->box);
    texels_put(p, param);
    return IMP_OK;
}

static void ies_put(struct putting *p, const struct imp_ies_data *d)
{
    const int32_t size[4] = {d->n_vertical, d->n_horizontal,
                             d->type | (d->length_c0 ? 4 : 0), d->n_tilts};
    const size_t n = (size_t)d->n_tilts;
    const double more[5] = {d->lamp_flux, d->watts, d->size[0], d->size[1], d->size[2]};
    const size_t v = (size_t)d->n_vertical, h = (size_t)d->n_horizontal;
    put_mark(p, MARK_IES);
    put(p, size, sizeof size);
    put(p, more, sizeof more);
    put(p, d->vertical, v * sizeof *d->vertical);
    put(p, d->horizontal, h * sizeof *d->horizontal);
    put(p, d->candela, v * h * sizeof *d->candela);
    put(p, d->tilt, n * sizeof *d->tilt);
    put(p, d->tilt_factor, n * sizeof *d->tilt_factor);
}

static void merl_put(struct putting *p, const struct imp_merl_data *d)
{
    const int32_t size[3] = {d->n_half, d->n_difference, d->n_azimuth};
    put_mark(p, MARK_MERL);
    put(p, size, sizeof size);
    put(p, d->rho,
        3 * (size_t)d->n_half * (size_t)d->n_difference * (size_t)d->n_azimuth *
            sizeof *d->rho);
}

static void measured_put(struct putting *p, const struct imp_measured_data *d)
{
    size_t count[IMP_MEASURED_TABLES];
    if (!imp__measured_counts(d, count)) return;
    put_mark(p, MARK_MEASURED);
    put(p, d, offsetof(struct imp_measured_data, table));
    for (int k = 0; k < IMP_MEASURED_TABLES; k++)
        if (count[k]) put(p, d->table[k], count[k] * sizeof *d->table[k]);
}

static bool is_mesh(const struct imp_node *node)
{
    static const char *const types[] = {"obj", "ply", "serialized", "mesh"};
    for (size_t k = 0; k < imp_count(types) && strcmp(node->tag, "shape") == 0; k++)
        if (strcmp(node->type, types[k]) == 0) return true;
    return false;
}

/* One triangle that has the bounds of all of them, and an area. */
static void bounds_put(struct putting *p, const struct imp_shape *s)
{
    const imp_v3 lo = s->lo, hi = s->hi;
    const bool flat = lo[1] == hi[1];
    const float at[9] = {(float)lo[0],
                         (float)lo[1],
                         (float)lo[2],
                         (float)hi[0],
                         (float)hi[1],
                         (float)hi[2],
                         (float)(flat ? hi[0] : lo[0]),
                         (float)hi[1],
                         (float)lo[2]};
    const uint32_t index[3] = {0, 1, 2};
    put_count(p, 3);
    put_count(p, 1);
    put(p, at, sizeof at);
    put(p, index, sizeof index);
}

static enum imp_status mesh_put(struct putting *p, const struct imp_node *node)
{
    const struct imp_shape *s = node->object;
    if (!s || s->geometry != IMP_TRIANGLES || s->by_triangle)
        return imp__node_error(p->scene->ctx, node, IMP_E_UNSUPPORTED,
                               s ? "its triangles count for its material (attributes, "
                                   "bump maps), and files of recorded walks have none"
                                 : "triangles of no shape are not written with kept "
                                   "walks");
    put_mark(p, MARK_MESH);
    if (s->emitter < 0) {
        bounds_put(p, s);
        return IMP_OK;
    }
    const struct imp_triangles *t = &s->triangles;
    put_count(p, t->n_vertices);
    put_count(p, t->n_triangles);
    put(p, t->positions, 3 * t->n_vertices * sizeof *t->positions);
    put(p, t->indices, 3 * t->n_triangles * sizeof *t->indices);
    return IMP_OK;
}

/* What files held is there by itself, and triangles are where they were placed. */
static bool prop_is_left_out(const struct putting *p, const struct imp_node *node,
                             const struct imp_prop *prop)
{
    static const char *const of_meshes[] = {"to_world", "flip_tex_coords", "shape_index",
                                            "face_normals"};
    if (p->scene->lenient && !prop->used) return true;
    if (strcmp(prop->name, "filename") == 0) return true;
    for (size_t k = 0; k < imp_count(of_meshes) && is_mesh(node); k++)
        if (strcmp(prop->name, of_meshes[k]) == 0) return true;
    return false;
}

static enum imp_status data_put(struct putting *p, const struct imp_node *node)
{
    const bool texture = strcmp(node->tag, "texture") == 0;
    if (node->attribute || node->body || strcmp(node->type, "graded") == 0)
        return imp__node_error(p->scene->ctx, node, IMP_E_UNSUPPORTED,
                               "it is not written with recorded walks");
    if (is_mesh(node)) return mesh_put(p, node);
    if (node->ies) ies_put(p, node->ies);
    if (node->merl) merl_put(p, node->merl);
    if (node->measured) measured_put(p, node->measured);
    if (texture && strcmp(node->type, "bitmap") == 0) image_put(p, node);
    if (strcmp(node->tag, "volume") == 0 && strcmp(node->type, "gridvolume") == 0)
        return grid_put(p, node);
    return IMP_OK;
}

/* id NULL: the node's own. */
static enum imp_status node_put(struct putting *p, const struct imp_node *node,
                                const char *id, const char *name);

static enum imp_status child_put(struct putting *p, const struct imp_child *c)
{
    if (p->scene->lenient && (!c->used || c->node->gone)) return IMP_OK;
    if (!c->ref) return node_put(p, c->node, NULL, c->name);
    if (!c->node->id)
        return imp__node_error(p->scene->ctx, c->node, IMP_E_UNSUPPORTED,
                               "a reference to it is not written with recorded walks");
    put_mark(p, MARK_REF);
    put_text(p, c->node->id);
    put_text(p, c->name);
    return IMP_OK;
}

static enum imp_status node_put(struct putting *p, const struct imp_node *node,
                                const char *id, const char *name)
{
    enum imp_status st = IMP_OK;
    put_mark(p, MARK_BEGIN);
    put_text(p, node->tag);
    put_text(p, is_mesh(node) ? "mesh" : node->type);
    put_text(p, id ? id : node->id);
    put_text(p, name);
    for (size_t k = 0; k < node->given_props && st == IMP_OK; k++)
        if (!prop_is_left_out(p, node, &node->props[k]))
            st = prop_put(p, node, &node->props[k]);
    const size_t n = imp_min((size_t)node->given_children, node->n_children);
    if (st == IMP_OK) st = data_put(p, node);
    for (size_t k = 0; k < n && st == IMP_OK; k++) st = child_put(p, &node->children[k]);
    put_mark(p, MARK_END);
    return st;
}

/* The node of a shape of a group; NULL: it has none. */
static const struct imp_node *member_of(const struct imp_node *root,
                                        const struct imp_shape *s)
{
    for (size_t k = 0; k < root->n_children; k++) {
        const struct imp_node *group = root->children[k].node;
        for (size_t i = 0; imp__is_group(group) && i < group->n_children; i++)
            if (group->children[i].node->object == s) return group->children[i].node;
    }
    return NULL;
}

/* Shapes of groups follow those of the scene, under their names, and so do those to which
 * an instance gives another material: as spheres, since only their uv are used. */
static enum imp_status members_put(struct putting *p)
{
    const struct imp_scene *scene = p->scene;
    enum imp_status st = IMP_OK;
    for (int k = scene->n_shapes; k < scene->n_all_shapes && st == IMP_OK; k++) {
        const struct imp_shape *s = scene->shapes[k];
        const struct imp_node *node = member_of(scene->root, s);
        if (node) {
            st = node_put(p, node, s->name, NULL);
            continue;
        }
        if (imp__is_bumped(scene, s->bsdf))
            return imp__error(scene->ctx, IMP_E_UNSUPPORTED,
                              "shape '%s': a bump map that its instance brings or "
                              "stretches is not written with recorded walks",
                              s->name);
        char id[32];
        snprintf(id, sizeof id, "covered shape %d", k);
        put_mark(p, MARK_BEGIN);
        put_text(p, "shape");
        put_text(p, "sphere");
        put_text(p, id);
        put_text(p, NULL);
        put_mark(p, MARK_REF);
        put_text(p, s->bsdf >= 0 ? scene->bsdfs[s->bsdf]->name : "");
        put_text(p, NULL);
        put_mark(p, MARK_END);
    }
    return st;
}

/* Shapes without a name are numbered, and instances, which are not written, have numbers
 * too: each takes along what it was called. */
static enum imp_status top_put(struct putting *p, const struct imp_child *c)
{
    const struct imp_node *node = c->node;
    const struct imp_shape *s = node->object;
    const bool numbered =
        strcmp(node->tag, "shape") == 0 && s && !c->ref && !c->name && !node->id;
    return numbered ? node_put(p, node, s->name, NULL) : child_put(p, c);
}

enum imp_status imp__tree_put(const struct imp_scene *scene, const double *theta,
                              struct imp_bytes *out)
{
    struct putting p = {.scene = scene, .theta = theta, .out = out};
    const struct imp_node *root = scene->root;
    enum imp_status st = IMP_OK;
    const uint8_t how[2] = {(uint8_t)scene->mode, scene->linear_colors};
    put(&p, how, sizeof how);
    for (size_t k = 0; k < root->n_children && st == IMP_OK; k++)
        if (!imp__is_group(root->children[k].node)) st = top_put(&p, &root->children[k]);
    if (st == IMP_OK) st = members_put(&p);
    put_mark(&p, MARK_END);
    if (st == IMP_OK && p.full)
        st = imp__error(scene->ctx, IMP_E_NOMEM, "no memory to write a scene");
    return st;
}
