/* SPDX-License-Identifier: Apache-2.0
 *
 * The meshes of an OBJ file by object and material, as shapes with bsdfs and lights. */
#include "obj_parts.h"
#include "base/arguments.h"
#include "base/nearest.h"
#include "load.h"
#include "search.h"
#include <math.h>
#include <stdio.h>
#include <string.h>

#define MTL_BYTES_MAX ((size_t)1 << 26)

/* ---- Names while faces are read ------------------------------------------------------ */

static const char *kept(const struct imp__obj_names *names, const char *s,
                        const char *end)
{
    while (s < end && (*s == ' ' || *s == '\t')) s++;
    while (s < end && (end[-1] == ' ' || end[-1] == '\t' || end[-1] == '\r')) end--;
    char *text = imp__arena_take(names->arena, (size_t)(end - s) + 1, 1);
    if (!text) return NULL;
    memcpy(text, s, (size_t)(end - s));
    text[end - s] = 0;
    return text;
}

static bool is(const char *word, size_t length, const char *name)
{
    return length == strlen(name) && memcmp(word, name, length) == 0;
}

bool imp__obj_name(struct imp__obj_names *names, const char *word, size_t length,
                   const char *s, const char *end, size_t n_triangles)
{
    const bool object = is(word, length, "o"), material = is(word, length, "usemtl");
    if (is(word, length, "mtllib")) {
        const char **grown = imp__grow(names->ctx, names->library, &names->cap_libraries,
                                       names->n_libraries + 1, sizeof *grown);
        if (!grown) return false;
        names->library = grown;
        const char *text = names->library[names->n_libraries++] = kept(names, s, end);
        return text != NULL;
    }
    if (!object && !material) return true;
    const char *text = kept(names, s, end);
    struct imp__obj_run *grown = imp__grow(names->ctx, names->run, &names->cap_runs,
                                           names->n_runs + 1, sizeof *grown);
    if (grown) names->run = grown;
    if (!grown || !text) return false;
    struct imp__obj_run run = {.first = n_triangles};
    if (names->n_runs) run = names->run[names->n_runs - 1];
    const bool empty = names->n_runs && run.first == n_triangles;
    run.first = n_triangles;
    if (object) run.object = text;
    else run.material = text;
    names->run[empty ? names->n_runs - 1 : names->n_runs++] = run;
    return true;
}

/* ---- Parts ----------------------------------------------------------------------------- */

struct parts {
    const struct imp__import *in;
    imp_context *ctx;
    struct imp_loc loc;
    struct imp_mesh_data all;
    struct imp__obj_names names;
    struct imp__mtl_list list;
    uint32_t *map; /* vertex of a part + 1, by vertex of the file */
    bool *done;    /* [n_runs] */
    double lo[3], hi[3];
    size_t n_lamps;
};

static bool same(const char *a, const char *b)
{
    return a == b || (a && b && strcmp(a, b) == 0);
}
static bool alike(const struct imp__obj_run *a, const struct imp__obj_run *b)
{
    return same(a->object, b->object) && same(a->material, b->material);
}

static size_t run_end(const struct parts *p, size_t i)
{
    return i + 1 < p->names.n_runs ? p->names.run[i + 1].first : p->all.n_triangles;
}

/* The triangles of all runs like run i, with their own vertices. */
static enum imp_status part_mesh(struct parts *p, size_t i, struct imp_mesh_data *out)
{
    const struct imp_mesh_source source = {.ctx = p->ctx,
                                           .keep = &p->in->scene->arena,
                                           .temporary = &p->in->scene->files,
                                           .name = p->in->name};
    size_t n_vertices = 0, n_triangles = 0, at = 0;
    float *position, *normal = NULL, *uv = NULL;
    uint32_t *index;
    memset(p->map, 0, p->all.n_vertices * sizeof *p->map);
    for (size_t k = i; k < p->names.n_runs; k++) {
        if (!alike(&p->names.run[i], &p->names.run[k])) continue;
        p->done[k] = true;
        for (size_t t = 3 * p->names.run[k].first; t < 3 * run_end(p, k); t++)
            if (!p->map[p->all.indices[t]])
                p->map[p->all.indices[t]] = (uint32_t)++n_vertices;
        n_triangles += run_end(p, k) - p->names.run[k].first;
    }
    out->n_triangles = 0;
    if (!n_triangles) return IMP_OK;
    IMP_CHECKED(imp__mesh_arrays(&source, n_vertices, n_triangles, &position,
                                 p->all.normals ? &normal : NULL, p->all.uvs ? &uv : NULL,
                                 &index, out));
    for (size_t k = i; k < p->names.n_runs; k++) {
        if (!alike(&p->names.run[i], &p->names.run[k])) continue;
        for (size_t t = 3 * p->names.run[k].first; t < 3 * run_end(p, k); t++)
            index[at++] = p->map[p->all.indices[t]] - 1;
    }
    for (size_t v = 0; v < p->all.n_vertices; v++) {
        if (!p->map[v]) continue;
        const size_t to = p->map[v] - 1;
        memcpy(position + 3 * to, p->all.positions + 3 * v, 3 * sizeof *position);
        if (normal) memcpy(normal + 3 * to, p->all.normals + 3 * v, 3 * sizeof *normal);
        if (uv) memcpy(uv + 2 * to, p->all.uvs + 2 * v, 2 * sizeof *uv);
        for (int k = 0; k < 3; k++) {
            p->lo[k] = fmin(p->lo[k], (double)position[3 * to + (size_t)k]);
            p->hi[k] = fmax(p->hi[k], (double)position[3 * to + (size_t)k]);
        }
    }
    return IMP_OK;
}

static enum imp_status material_of(struct parts *p, const char *name,
                                   struct imp__mtl **out)
{
    struct imp_nearest near = imp__nearest(name ? name : "");
    *out = NULL;
    if (!name) return IMP_OK;
    for (size_t i = 0; i < p->list.n && !*out; i++) {
        if (strcmp(p->list.material[i].name, name) == 0) *out = &p->list.material[i];
        imp__nearest_try(&near, p->list.material[i].name);
    }
    if (*out) return IMP_OK;
    if (p->in->scene->lenient) {
        char lost[300];
        snprintf(lost, sizeof lost,
                 "%.150s: material '%.80s' is in none of its libraries: "
                 "diffuse grey",
                 p->in->name, name);
        return imp__lost_add(p->in->scene, lost);
    }
    return imp__loc_error(p->ctx, p->loc, IMP_E_SCENE,
                          "material '%.80s' is in none of its libraries%s%s%s", name,
                          near.best ? "; did you mean '" : "", near.best ? near.best : "",
                          near.best ? "'?" : "");
}

static enum imp_status part_make(struct parts *p, size_t i)
{
    const struct imp__obj_run *run = &p->names.run[i];
    struct imp_tree *tree = p->in->tree;
    struct imp_mesh_data *data = imp__arena_array(&p->in->scene->files, 1, sizeof *data);
    struct imp__mtl *m;
    struct imp_node *shape, *light;
    if (!data) return imp__error(p->ctx, IMP_E_NOMEM, "%s: out of memory", p->in->name);
    IMP_CHECKED(part_mesh(p, i, data));
    if (!data->n_triangles) return IMP_OK;
    IMP_CHECKED(material_of(p, run->material, &m));
    if (m) IMP_CHECKED(imp__mtl_make(p->in, m));
    const char *id = imp__import_name(p->in, run->object ? run->object : "mesh");
    if (!id) return imp__error(p->ctx, IMP_E_NOMEM, "%s: out of memory", p->in->name);
    IMP_CHECKED(
        imp__tree_open(tree, p->in->parent, "shape", "mesh", id, NULL, p->loc, &shape));
    shape->mesh = data;
    if (!data->normals)
        IMP_CHECKED(imp__import_bool(p->in, shape, "face_normals", true, p->loc));
    if (!m) return IMP_OK;
    IMP_CHECKED(imp__tree_ref(tree, shape, m->id, NULL, p->loc));
    if (!(m->ke[0] > 0 || m->ke[1] > 0 || m->ke[2] > 0)) return IMP_OK;
    p->n_lamps++;
    IMP_CHECKED(
        imp__tree_open(tree, shape, "emitter", "area", NULL, NULL, p->loc, &light));
    double efficacy, radiance[3];
    IMP_CHECKED(imp__import_number(p->in, "efficacy", "1", 0, 1e6, &efficacy));
    for (int k = 0; k < 3; k++) radiance[k] = efficacy * m->ke[k];
    return imp__import_rgb(p->in, light, "radiance", radiance, p->loc);
}

static enum imp_status libraries_read(struct parts *p)
{
    const char *folder = imp__folder_of(p->in->scene, p->in->name), *path;
    if (!folder) return imp__error(p->ctx, IMP_E_NOMEM, "%s: out of memory", p->in->name);
    for (size_t i = 0; i < p->names.n_libraries; i++) {
        struct imp_bytes text = {0};
        enum imp_status st =
            imp__search(p->in->scene, folder, p->names.library[i], &path);
        if (st == IMP_E_IO && p->in->scene->lenient) {
            char lost[400];
            snprintf(lost, sizeof lost,
                     "%.150s: mtllib '%.150s' is not there: its "
                     "materials are diffuse grey",
                     p->in->name, p->names.library[i]);
            IMP_CHECKED(imp__lost_add(p->in->scene, lost));
            continue;
        }
        if (st != IMP_OK) return imp__error_prefix(p->ctx, st, "%s: mtllib", p->in->name);
        if (st == IMP_OK) st = imp__file_read(p->ctx, path, MTL_BYTES_MAX, &text);
        if (st == IMP_OK) st = imp__mtl_parse(p->in, path, &text, &p->list);
        imp__bytes_free(p->ctx, &text);
        if (st != IMP_OK) return st;
    }
    return IMP_OK;
}

enum imp_status imp__obj_read(const struct imp__import *in)
{
    enum imp_status st = IMP_OK;
    struct parts p = {.in = in,
                      .ctx = in->scene->ctx,
                      .loc = {in->name, 1, 1},
                      .names = {.ctx = in->scene->ctx, .arena = &in->scene->files},
                      .lo = {INFINITY, INFINITY, INFINITY},
                      .hi = {-INFINITY, -INFINITY, -INFINITY}};
    const struct imp_mesh_source source = {.ctx = p.ctx,
                                           .keep = &in->scene->files,
                                           .temporary = &in->scene->files,
                                           .name = in->name,
                                           .text = *in->text,
                                           .flip_v = true};
    /* Faces before the first o or usemtl. */
    static const char none[] = "";
    if (!imp__obj_name(&p.names, "o", 1, none, none, 0))
        IMP_TRY(imp__error(p.ctx, IMP_E_NOMEM, "%s: out of memory", in->name));
    p.names.run[0].object = NULL;
    IMP_TRY(imp__obj_parse_names(&source, &p.names, &p.all));
    IMP_TRY(libraries_read(&p));
    p.map = imp__alloc(p.ctx, p.all.n_vertices, sizeof *p.map);
    p.done = imp__alloc(p.ctx, p.names.n_runs, sizeof *p.done);
    if (!p.map || !p.done)
        IMP_TRY(imp__error(p.ctx, IMP_E_NOMEM, "%s: out of memory", in->name));
    memset(p.done, 0, p.names.n_runs * sizeof *p.done);
    for (size_t i = 0; i < p.names.n_runs; i++)
        if (!p.done[i]) IMP_TRY(part_make(&p, i));
    if (in->alone) {
        IMP_TRY(imp__import_camera(in, p.lo, p.hi, p.loc));
        if (!p.n_lamps) IMP_TRY(imp__import_sky(in, p.loc));
    }
out:
    imp__release(p.ctx, p.map);
    imp__release(p.ctx, p.done);
    imp__release(p.ctx, p.names.run);
    imp__release(p.ctx, p.names.library);
    imp__release(p.ctx, p.list.material);
    return st;
}
