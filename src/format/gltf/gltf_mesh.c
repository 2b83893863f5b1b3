/* SPDX-License-Identifier: Apache-2.0
 *
 * Meshes: each primitive of triangles, strips or fans is one mesh of the scene. */
#include "format/mesh_file.h"
#include "gltf.h"
#include <math.h>
#include <stdio.h>
#include <string.h>

enum { POINTS, LINES, LINE_LOOP, LINE_STRIP, TRIANGLES, STRIP, FAN, MODES };

struct reading {
    struct gltf *g;
    size_t mesh, at; /* primitive `at` of it */
    const json_t *object, *attributes;
    size_t n_vertices, n_indices;
    struct gltf_accessor index;
    bool indexed, textured;
};

static void there(const struct reading *r)
{
    snprintf(r->g->where, sizeof r->g->where, "meshes[%zu].primitives[%zu]", r->mesh,
             r->at);
}

/* An attribute with n numbers a vertex; found: it is there. */
static enum imp_status attribute(const struct reading *r, const char *name, int n,
                                 bool *found, struct gltf_accessor *out)
{
    int index;
    there(r);
    IMP_CHECKED(imp__gltf_index(r->g, r->attributes, name,
                                imp__gltf_count(r->g, "accessors"), &index));
    *found = index >= 0;
    if (!*found) return IMP_OK;
    IMP_CHECKED(imp__gltf_accessor(r->g, (size_t)index, out));
    there(r);
    if (out->n < n)
        return imp__gltf_error(r->g, "%s has %d numbers, not %d", name, out->n, n);
    if (r->n_vertices && out->count != r->n_vertices)
        return imp__gltf_error(r->g, "%s has %zu elements, POSITION %zu", name,
                               out->count, r->n_vertices);
    return IMP_OK;
}

static enum imp_status floats(const struct reading *r, const char *name,
                              const struct gltf_accessor *a, int n, float *out)
{
    for (size_t i = 0; i < a->count; i++) {
        imp__gltf_element(a, i, n, out + i * (size_t)n);
        for (int k = 0; k < n; k++)
            if (!isfinite(out[i * (size_t)n + (size_t)k]))
                return imp__gltf_error(r->g, "%s of vertex %zu is %g", name, i,
                                       (double)out[i * (size_t)n + (size_t)k]);
    }
    return IMP_OK;
}

/* Corner k of the list, whether it has indices or not. */
static enum imp_status corner(const struct reading *r, size_t k, uint32_t *out)
{
    *out = r->indexed ? imp__gltf_integer(&r->index, k) : (uint32_t)k;
    if (*out < r->n_vertices) return IMP_OK;
    return imp__gltf_error(r->g, "index %zu is %u of %zu vertices", k, *out,
                           r->n_vertices);
}

/* Triangles of a list, a strip or a fan (3.7.2.1), without those of a strip that repeat
 * a vertex to begin a new one. */
static enum imp_status triangles(const struct reading *r, int mode, uint32_t *out,
                                 size_t *n)
{
    const size_t most = mode == TRIANGLES ? r->n_indices / 3 : r->n_indices - 2;
    *n = 0;
    for (size_t t = 0; t < most; t++) {
        const size_t at[3] = {
            mode == TRIANGLES ? 3 * t
            : mode == STRIP   ? t
                              : 0,
            mode == TRIANGLES ? 3 * t + 1 : t + 1 + (mode == STRIP && t % 2),
            mode == TRIANGLES ? 3 * t + 2 : t + 2 - (mode == STRIP && t % 2)};
        uint32_t v[3];
        for (int k = 0; k < 3; k++) IMP_CHECKED(corner(r, at[k], &v[k]));
        if (mode != TRIANGLES && (v[0] == v[1] || v[1] == v[2] || v[2] == v[0])) continue;
        memcpy(out + 3 * (*n)++, v, sizeof v);
    }
    return IMP_OK;
}

/* Colours of vertices multiply the base colour; white ones, which exporters write, do
 * nothing. */
static enum imp_status colors(const struct reading *r)
{
    struct gltf_accessor a;
    bool found;
    IMP_CHECKED(attribute(r, "COLOR_0", 3, &found, &a));
    if (!found) return IMP_OK;
    for (size_t i = 0; i < a.count; i++) {
        float c[3];
        imp__gltf_element(&a, i, 3, c);
        if (!(c[0] == 1 && c[1] == 1 && c[2] == 1))
            return imp__gltf_unread(r->g, "they are left out", "%s: colours of vertices",
                                    r->g->where);
    }
    return IMP_OK;
}

static enum imp_status indices(struct reading *r)
{
    int index;
    IMP_CHECKED(imp__gltf_index(r->g, r->object, "indices",
                                imp__gltf_count(r->g, "accessors"), &index));
    r->indexed = index >= 0;
    r->n_indices = r->n_vertices;
    if (!r->indexed) return IMP_OK;
    IMP_CHECKED(imp__gltf_accessor(r->g, (size_t)index, &r->index));
    there(r);
    if (r->index.n != 1 || r->index.normalized || r->index.component == 5126 ||
        r->index.component == 5120 || r->index.component == 5122)
        return imp__gltf_error(r->g, "its indices are not unsigned integers");
    r->n_indices = r->index.count;
    return IMP_OK;
}

static enum imp_status arrays(struct reading *r, int mode, int texcoord,
                              struct gltf_primitive *out)
{
    struct gltf *g = r->g;
    struct gltf_accessor position, normal, uv;
    bool found, has_normals, has_uvs;
    float *p, *n, *t;
    uint32_t *index;
    char name[32];
    IMP_CHECKED(attribute(r, "POSITION", 3, &found, &position));
    if (!found) return IMP_OK; /* nothing is drawn (3.7.2.1) */
    r->n_vertices = position.count;
    snprintf(name, sizeof name, "TEXCOORD_%d", texcoord);
    IMP_CHECKED(attribute(r, "NORMAL", 3, &has_normals, &normal));
    IMP_CHECKED(attribute(r, name, 2, &has_uvs, &uv));
    if (r->textured && !has_uvs)
        imp__warn(g->ctx, "%s: %s: its material has textures, and it no %s", g->in->name,
                  g->where, name);
    IMP_CHECKED(colors(r));
    IMP_CHECKED(indices(r));
    if (r->n_indices < 3) return IMP_OK;
    const size_t n_most = mode == TRIANGLES ? r->n_indices / 3 : r->n_indices - 2;
    IMP_CHECKED(imp__gltf_made(g, 12. * (double)n_most + 32. * (double)r->n_vertices));
    const struct imp_mesh_source source = {.ctx = g->ctx,
                                           .keep = &g->in->scene->arena,
                                           .temporary = &g->in->scene->files,
                                           .name = g->in->name};
    struct imp_mesh_data *data = imp__arena_array(&g->in->scene->files, 1, sizeof *data);
    if (!data) return imp__gltf_memory(g);
    IMP_CHECKED(imp__mesh_arrays(&source, r->n_vertices, n_most, &p,
                                 has_normals ? &n : NULL, has_uvs ? &t : NULL, &index,
                                 data));
    IMP_CHECKED(floats(r, "POSITION", &position, 3, p));
    if (has_normals) IMP_CHECKED(floats(r, "NORMAL", &normal, 3, n));
    if (has_uvs) IMP_CHECKED(floats(r, name, &uv, 2, t));
    IMP_CHECKED(triangles(r, mode, index, &data->n_triangles));
    if (!data->n_triangles) return IMP_OK;
    for (int k = 0; k < 3; k++) out->lo[k] = INFINITY, out->hi[k] = -INFINITY;
    for (size_t i = 0; i < 3 * r->n_vertices; i++) {
        out->lo[i % 3] = fmin(out->lo[i % 3], (double)p[i]);
        out->hi[i % 3] = fmax(out->hi[i % 3], (double)p[i]);
    }
    out->mesh = data;
    return IMP_OK;
}

static enum imp_status primitive(struct reading *r, struct gltf_primitive *out)
{
    static const char *const drawn[] = {"points", "lines", "a line loop", "a line strip"};
    struct gltf *g = r->g;
    struct gltf_material *material;
    size_t mode = TRIANGLES;
    there(r);
    if (!json_is_object(r->object)) return imp__gltf_error(g, "is no object");
    r->attributes = json_object_get(r->object, "attributes");
    IMP_CHECKED(imp__gltf_size(g, r->object, "mode", MODES, &mode));
    IMP_CHECKED(
        imp__gltf_index(g, r->object, "material", g->n_materials, &out->material));
    if (mode < TRIANGLES)
        return imp__gltf_unread(g, "they are left out", "%s: %s", g->where, drawn[mode]);
    if (imp__gltf_extension(r->object, "KHR_draco_mesh_compression"))
        return imp__gltf_unread(g, "it is left out", "%s: KHR_draco_mesh_compression",
                                g->where);
    IMP_CHECKED(imp__gltf_material(g, out->material, &material));
    r->textured = material->textured;
    return arrays(r, (int)mode, material->texcoord, out);
}

enum imp_status imp__gltf_mesh(struct gltf *g, size_t index, struct gltf_mesh **out)
{
    struct gltf_mesh *mesh = *out = &g->mesh[index];
    const json_t *object;
    if (mesh->primitive) return IMP_OK;
    IMP_CHECKED(imp__gltf_item(g, "meshes", index, &object));
    const json_t *list = json_object_get(object, "primitives");
    mesh->n = json_array_size(list);
    mesh->primitive =
        imp__arena_array(&g->in->scene->files, mesh->n + 1, sizeof *mesh->primitive);
    if (!mesh->primitive) return imp__gltf_memory(g);
    const json_t *weights = json_object_get(object, "weights");
    for (size_t i = 0; i < json_array_size(weights); i++)
        if (json_number_value(json_array_get(weights, i)) != 0)
            return imp__gltf_unread(g, "it has its first shape", "%s: morph targets",
                                    g->where);
    for (size_t i = 0; i < mesh->n; i++) {
        struct reading r = {
            .g = g, .mesh = index, .at = i, .object = json_array_get(list, i)};
        IMP_CHECKED(primitive(&r, &mesh->primitive[i]));
    }
    return IMP_OK;
}
