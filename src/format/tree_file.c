/* SPDX-License-Identifier: Apache-2.0 */
#include "tree_file.h"
#include "ies_file.h"
#include "load.h"
#include "mesh_file.h"
#include "scene/instances.h"
#include "tree.h"
#include <stdio.h>
#include <string.h>

/* What comes next; a text is its length and its bytes, NULL has the length UINT32_MAX. */
enum mark {
    MARK_END, /* of the object; of the scene, the last byte */
    MARK_BEGIN,
    MARK_BOOL,
    MARK_INTEGER,
    MARK_FLOAT,
    MARK_STRING,
    MARK_VECTOR,
    MARK_RGB,
    MARK_SPECTRUM,
    MARK_TRANSFORM,
    MARK_REF,
    MARK_IMAGE,
    MARK_MESH,
    MARK_IES,
    MARK_MERL,
    MARK_GRID
};
#define TEXT_MAX ((size_t)1 << 16)

/* ---- Writing ------------------------------------------------------------------------- */

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
static void put_mark(struct putting *p, enum mark mark)
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

static void put_number(struct putting *p, const struct imp_prop *prop, enum mark mark,
                       size_t n)
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
                               "this reference is not written with kept walks");
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
    const int32_t size[2] = {d->n_vertical, d->n_horizontal};
    const size_t v = (size_t)d->n_vertical, h = (size_t)d->n_horizontal;
    put_mark(p, MARK_IES);
    put(p, size, sizeof size);
    put(p, d->vertical, v * sizeof *d->vertical);
    put(p, d->horizontal, h * sizeof *d->horizontal);
    put(p, d->candela, v * h * sizeof *d->candela);
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
                                   "bump maps), and files of kept walks have none"
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
                               "it is not written with kept walks");
    if (is_mesh(node)) return mesh_put(p, node);
    if (node->ies) ies_put(p, node->ies);
    if (node->merl) merl_put(p, node->merl);
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
                               "a reference to it is not written with kept walks");
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

/* Shapes of groups stand behind those of the scene, under the names that they have, and
 * so do those that an instance has covered with another material. */
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

enum imp_status imp__tree_put(const struct imp_scene *scene, const double *theta,
                              struct imp_bytes *out)
{
    struct putting p = {.scene = scene, .theta = theta, .out = out};
    const struct imp_node *root = scene->root;
    enum imp_status st = IMP_OK;
    const uint8_t how[2] = {(uint8_t)scene->mode, scene->linear_colors};
    put(&p, how, sizeof how);
    for (size_t k = 0; k < root->n_children && st == IMP_OK; k++)
        if (!imp__is_group(root->children[k].node))
            st = child_put(&p, &root->children[k]);
    if (st == IMP_OK) st = members_put(&p);
    put_mark(&p, MARK_END);
    if (st == IMP_OK && p.full)
        st = imp__error(scene->ctx, IMP_E_NOMEM, "no memory to write a scene");
    return st;
}

/* ---- Reading ------------------------------------------------------------------------- */

struct taking {
    struct imp_scene *scene;
    const unsigned char *at, *end;
    char text[4][TEXT_MAX];
};

static bool take(struct taking *t, void *out, size_t n)
{
    if ((size_t)(t->end - t->at) < n) return false;
    memcpy(out, t->at, n);
    t->at += n;
    return true;
}

/* In text[k]; *out NULL: there is none. */
static bool take_text(struct taking *t, int k, const char **out)
{
    uint32_t n;
    *out = NULL;
    if (!take(t, &n, sizeof n)) return false;
    if (n == UINT32_MAX) return true;
    if (n >= TEXT_MAX || !take(t, t->text[k], n) || memchr(t->text[k], 0, n))
        return false;
    t->text[k][n] = 0;
    *out = t->text[k];
    return true;
}

/* Arrays in the arena of files, which the scene frees when it is made: `keep`: in that of
 * the scene. NULL: there are not as many bytes, or no memory. */
static void *take_array(struct taking *t, size_t n, size_t size, bool keep)
{
    if (n > (size_t)(t->end - t->at) / size) return NULL;
    void *out = imp__arena_take(keep ? &t->scene->arena : &t->scene->files, n + 1, size);
    if (out) take(t, out, n * size);
    return out;
}

static struct imp_node *top_of(struct taking *t)
{
    return t->scene->stack[t->scene->n_stack - 1];
}

static bool all_in(const double *x, size_t n, double lo, double hi)
{
    for (size_t k = 0; k < n; k++)
        if (!(x[k] >= lo && x[k] <= hi)) return false;
    return true;
}

static bool take_ies(struct taking *t)
{
    int32_t size[2];
    struct imp_node *node = top_of(t);
    struct imp_ies_data *d = imp__arena_array(&t->scene->arena, 1, sizeof *d);
    if (!d || node->ies || strcmp(node->tag, "emitter") != 0 ||
        !take(t, size, sizeof size) || size[0] < 2 || size[1] < 1 ||
        size[0] > IMP_IES_ANGLES_MAX || size[1] > IMP_IES_ANGLES_MAX)
        return false;
    const size_t v = (size_t)size[0], h = (size_t)size[1];
    d->n_vertical = size[0];
    d->n_horizontal = size[1];
    d->vertical = take_array(t, v, sizeof(double), true);
    d->horizontal = take_array(t, h, sizeof(double), true);
    d->candela = take_array(t, v * h, sizeof(double), true);
    node->ies = d;
    return d->vertical && d->horizontal && d->candela && imp__ies_is_valid(d) &&
           all_in(d->candela, v * h, 0, 1e300);
}

static bool take_merl(struct taking *t)
{
    int32_t size[3];
    struct imp_node *node = top_of(t);
    struct imp_merl_data *d = imp__arena_array(&t->scene->arena, 1, sizeof *d);
    if (!d || node->merl || !take(t, size, sizeof size)) return false;
    for (int k = 0; k < 3; k++)
        if (size[k] < 1 || size[k] > 1 << 12) return false;
    const size_t n = 3 * (size_t)size[0] * (size_t)size[1] * (size_t)size[2];
    const float *rho = take_array(t, n, sizeof *rho, true);
    for (size_t k = 0; rho && k < n; k++)
        if (!(rho[k] >= 0 && rho[k] < 1e30f)) return false;
    *d = (struct imp_merl_data){size[0], size[1], size[2], rho};
    node->merl = d;
    return rho != NULL;
}

static bool take_grid(struct taking *t)
{
    int32_t size[4];
    float box[6];
    size_t n = 1;
    struct imp_node *node = top_of(t);
    struct imp_grid_data *d = imp__arena_array(&t->scene->files, 1, sizeof *d);
    if (!d || node->grid || !take(t, size, sizeof size) || !take(t, box, sizeof box) ||
        (size[3] != 1 && size[3] != 3))
        return false;
    for (int k = 0; k < 4; k++)
        if (size[k] < 1 || size[k] > INT32_MAX / 4 ||
            __builtin_mul_overflow(n, (size_t)size[k], &n))
            return false;
    const float *value = take_array(t, n, sizeof *value, false);
    for (size_t k = 0; value && k < n; k++)
        if (!isfinite(value[k])) return false;
    for (int k = 0; k < 6; k++)
        if (!isfinite(box[k])) return false;
    *d = (struct imp_grid_data){
        .n = {size[0], size[1], size[2]}, .channels = size[3], .value = value};
    memcpy(d->box, box, sizeof box);
    node->grid = d;
    return value != NULL;
}

static bool take_image(struct taking *t)
{
    int32_t size[3];
    if (!take(t, size, sizeof size)) return false;
    for (int k = 0; k < 3; k++)
        if (size[k] < 1 || size[k] > 1 << 20) return false;
    const float *pixels = take_array(
        t, (size_t)size[0] * (size_t)size[1] * (size_t)size[2], sizeof *pixels, false);
    if (pixels) imp_scene_image(t->scene, size[0], size[1], size[2], pixels);
    return pixels != NULL;
}

static bool take_mesh(struct taking *t)
{
    uint64_t n[2];
    if (!take(t, n, sizeof n) || n[0] > IMP_MESH_MAX || n[1] > IMP_MESH_MAX) return false;
    const float *at = take_array(t, 3 * n[0], sizeof *at, false);
    const uint32_t *index = at ? take_array(t, 3 * n[1], sizeof *index, false) : NULL;
    if (index) imp_scene_mesh(t->scene, n[0], n[1], at, NULL, NULL, index);
    return index != NULL;
}

static bool take_spectrum(struct taking *t, const char *name)
{
    uint64_t n;
    double value;
    if (!take(t, &n, sizeof n)) return false;
    if (n == 0) {
        if (!take(t, &value, sizeof value)) return false;
        imp_scene_spectrum(t->scene, name, 1, NULL, &value);
        return true;
    }
    const double *list =
        n > SIZE_MAX / 32 ? NULL : take_array(t, 2 * n, sizeof *list, false);
    if (list) imp_scene_spectrum(t->scene, name, n, list, list + n);
    return list != NULL;
}

/* A property; its name is in text[0]. */
static bool take_prop(struct taking *t, enum mark mark)
{
    const char *name, *text;
    uint8_t yes;
    int64_t integer;
    double x[16];
    struct imp_scene *s = t->scene;
    if (!take_text(t, 0, &name) || !name || strcmp(name, "filename") == 0) return false;
    switch (mark) {
    case MARK_BOOL:
        if (!take(t, &yes, 1)) return false;
        imp_scene_bool(s, name, yes);
        return true;
    case MARK_INTEGER:
        if (!take(t, &integer, sizeof integer)) return false;
        imp_scene_integer(s, name, integer);
        return true;
    case MARK_STRING:
        if (!take_text(t, 1, &text) || !text) return false;
        imp_scene_string(s, name, text);
        return true;
    case MARK_FLOAT:
        if (!take(t, x, sizeof *x)) return false;
        imp_scene_float(s, name, x[0]);
        return true;
    case MARK_VECTOR:
    case MARK_RGB:
        if (!take(t, x, 3 * sizeof *x)) return false;
        if (mark == MARK_RGB) imp_scene_rgb(s, name, x);
        else imp_scene_vector(s, name, x);
        return true;
    case MARK_TRANSFORM:
        if (!take(t, x, sizeof x)) return false;
        imp_scene_transform(s, name, x);
        return true;
    case MARK_SPECTRUM: return take_spectrum(t, name);
    default: return false;
    }
}

static bool take_begin(struct taking *t)
{
    const char *text[4];
    for (int k = 0; k < 4; k++)
        if (!take_text(t, k, &text[k])) return false;
    if (!text[0] || !text[1]) return false;
    imp_scene_begin(t->scene, text[0], text[1], text[2], text[3]);
    return true;
}

static bool take_ref(struct taking *t)
{
    const char *id, *name;
    if (!take_text(t, 0, &id) || !take_text(t, 1, &name) || !id) return false;
    imp_scene_ref(t->scene, id, name);
    return true;
}

/* Up to the end of the scene, or the first call that fails, whose reason commit has. */
static bool take_calls(struct taking *t)
{
    while (t->scene->build_status == IMP_OK) {
        uint8_t mark;
        bool good = true;
        if (!take(t, &mark, 1)) return false;
        const bool inside = t->scene->n_stack > 1;
        if (mark == MARK_END && !inside) return t->at == t->end;
        if (mark == MARK_END) imp_scene_end(t->scene);
        else if (mark == MARK_BEGIN) good = take_begin(t);
        else if (mark == MARK_REF) good = take_ref(t);
        else if (!inside) return false;
        else if (mark == MARK_IMAGE) good = take_image(t);
        else if (mark == MARK_MESH) good = take_mesh(t);
        else if (mark == MARK_IES) good = take_ies(t);
        else if (mark == MARK_MERL) good = take_merl(t);
        else if (mark == MARK_GRID) good = take_grid(t);
        else good = take_prop(t, (enum mark)mark);
        if (!good) return false;
    }
    return true;
}

enum imp_status imp__tree_take(imp_context *ctx, const char *name,
                               const unsigned char *bytes, size_t n, imp_scene **out)
{
    enum imp_status st = IMP_OK;
    struct imp_load_options o = IMP_LOAD_OPTIONS_INIT;
    struct taking *t = imp__alloc(ctx, 1, sizeof *t);
    uint8_t how[2];
    if (!t) return imp__error(ctx, IMP_E_NOMEM, "%s: no memory for a scene", name);
    t->at = bytes;
    t->end = bytes + n;
    if (!take(t, how, sizeof how) || how[0] > IMP_SINGLE || how[1] > 1)
        IMP_TRY(imp__error(ctx, IMP_E_SCENE, "%s: damaged (its scene)", name));
    o.mode = (enum imp_color_mode)how[0];
    o.upsampling = how[1] ? IMP_UPSAMPLING_LINEAR : IMP_UPSAMPLING_SIGMOID;
    IMP_TRY(imp_scene_create(ctx, &o, &t->scene));
    t->scene->rayless = true;
    if (!take_calls(t))
        IMP_TRY(imp__error(ctx, IMP_E_SCENE, "%s: damaged (its scene)", name));
    st = imp_scene_commit(t->scene);
    if (st != IMP_OK) IMP_TRY(imp__error_prefix(ctx, st, "%s: its scene", name));
    *out = t->scene;
    t->scene = NULL;
out:
    imp_scene_destroy(t->scene);
    imp__release(ctx, t);
    return st;
}
