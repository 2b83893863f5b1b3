/* SPDX-License-Identifier: Apache-2.0
 *
 * Radiance's surfaces as shapes (docs/import.md). Polygons of one material are one mesh,
 * those that are lights each a shape with the light's name, so that each is a lamp. */
#include "mesh_file.h"
#include "polygon_cut.h"
#include "rad.h"
#include <math.h>
#include <stdio.h>
#include <string.h>

#define RING_SEGMENTS 128

bool imp__rad_is_surface(const char *type)
{
    static const char *const types[] = {"source", "sphere",   "bubble",   "polygon",
                                        "cone",   "cup",      "cylinder", "tube",
                                        "ring",   "instance", "mesh"};
    for (size_t i = 0; i < imp_count(types); i++)
        if (strcmp(types[i], type) == 0) return true;
    return false;
}

static enum imp_status no_memory(const struct rad_reader *r)
{
    return imp__error(r->ctx, IMP_E_NOMEM, "scene: out of memory");
}

/* A shape with its bsdf or light. */
static enum imp_status shape_open(const struct rad_reader *r,
                                  const struct rad_modifier *m, const char *bsdf,
                                  const char *type, struct imp_node **out)
{
    enum imp_status st = IMP_OK;
    const struct imp_loc loc = imp__rad_loc(r);
    struct imp_node *light;
    IMP_TRY(
        imp__tree_open(r->in->tree, r->in->parent, "shape", type, NULL, NULL, loc, out));
    if (bsdf) IMP_TRY(imp__tree_ref(r->in->tree, *out, bsdf, NULL, loc));
    if (m->kind != RAD_LIGHT) return IMP_OK;
    const char *id = imp__import_id(r->in, r->p.id);
    if (!id) return no_memory(r);
    IMP_TRY(imp__tree_open(r->in->tree, *out, "emitter", "area", id, NULL, loc, &light));
    double radiance[3];
    for (int k = 0; k < 3; k++) radiance[k] = r->efficacy * m->value[k];
    IMP_TRY(imp__import_rgb(r->in, light, "radiance", radiance, loc));
out:
    return st;
}

/* ---- Meshes ---------------------------------------------------------------------- */

/* The mesh that triangles of this surface go to. */
static enum imp_status mesh_of(struct rad_reader *r, struct rad_modifier *m,
                               const char *bsdf, struct rad_mesh **out)
{
    enum imp_status st = IMP_OK;
    *out = m->mesh;
    if (*out) return IMP_OK;
    struct rad_mesh *mesh = imp__alloc(r->ctx, 1, sizeof *mesh);
    if (!mesh) return no_memory(r);
    mesh->next = r->meshes;
    r->meshes = mesh;
    IMP_TRY(shape_open(r, m, bsdf, "mesh", &mesh->node));
    IMP_TRY(imp__import_bool(r->in, mesh->node, "face_normals", true, imp__rad_loc(r)));
    if (m->kind != RAD_LIGHT) m->mesh = mesh;
    *out = mesh;
out:
    return st;
}

static enum imp_status mesh_add(struct rad_reader *r, struct rad_mesh *mesh,
                                const double *p, size_t n, const uint32_t *index,
                                size_t n_triangles)
{
    const size_t first = mesh->n_position / 3;
    if (first + n > IMP_MESH_MAX || mesh->n_index / 3 + n_triangles > IMP_MESH_MAX)
        return imp__rad_error(r, "more than 2^31 corners of one material");
    float *position = imp__grow(r->ctx, mesh->position, &mesh->cap_position,
                                mesh->n_position + 3 * n, sizeof *position);
    if (position) mesh->position = position;
    uint32_t *grown = imp__grow(r->ctx, mesh->index, &mesh->cap_index,
                                mesh->n_index + 3 * n_triangles, sizeof *grown);
    if (grown) mesh->index = grown;
    if (!position || !grown) return no_memory(r);
    for (size_t i = 0; i < 3 * n; i++) mesh->position[mesh->n_position++] = (float)p[i];
    for (size_t i = 0; i < 3 * n_triangles; i++)
        mesh->index[mesh->n_index++] = (uint32_t)first + index[i];
    return IMP_OK;
}

enum imp_status imp__rad_meshes_finish(struct rad_reader *r)
{
    enum imp_status st = IMP_OK;
    struct imp_scene *scene = r->in->scene;
    for (const struct rad_mesh *m = r->meshes; m; m = m->next) {
        const struct imp_mesh_source source = {.ctx = r->ctx,
                                               .keep = &scene->arena,
                                               .temporary = &scene->files,
                                               .name = r->in->name};
        struct imp_mesh_data *data = imp__arena_array(&scene->files, 1, sizeof *data);
        float *p;
        uint32_t *index;
        if (!data) IMP_TRY(no_memory(r));
        IMP_TRY(imp__mesh_arrays(&source, m->n_position / 3, m->n_index / 3, &p, NULL,
                                 NULL, &index, data));
        memcpy(p, m->position, m->n_position * sizeof *p);
        memcpy(index, m->index, m->n_index * sizeof *index);
        m->node->mesh = data;
    }
out:
    return st;
}

void imp__rad_meshes_free(struct rad_reader *r)
{
    while (r->meshes) {
        struct rad_mesh *m = r->meshes;
        r->meshes = m->next;
        imp__release(r->ctx, m->position);
        imp__release(r->ctx, m->index);
        imp__release(r->ctx, m);
    }
}

/* ---- One function a surface ------------------------------------------------------ */

typedef enum imp_status surface(struct rad_reader *r, struct rad_modifier *m,
                                const char *bsdf);

static enum imp_status polygon(struct rad_reader *r, struct rad_modifier *m,
                               const char *bsdf)
{
    enum imp_status st = IMP_OK;
    const size_t n = r->p.n_real / 3;
    size_t n_triangles;
    struct rad_mesh *mesh;
    if (r->p.n_real % 3 || n < 3)
        return imp__rad_error(r,
                              "has %zu numbers, not three for each of three corners "
                              "or more",
                              r->p.n_real);
    uint32_t *cut = imp__grow(r->ctx, r->cut, &r->cap_cut, 3 * (n - 2), sizeof *cut);
    if (!cut) return no_memory(r);
    r->cut = cut;
    st = imp__polygon_cut(r->ctx, r->p.real, n, r->cut, &n_triangles);
    if (st != IMP_OK) {
        char why[200];
        snprintf(why, sizeof why, "%s", imp_last_error(r->ctx));
        return imp__rad_error(r, "%s", why);
    }
    if (n_triangles == 0) {
        if (!r->n_empty++) r->first_empty = r->p.line;
        return IMP_OK;
    }
    IMP_TRY(mesh_of(r, m, bsdf, &mesh));
    IMP_TRY(mesh_add(r, mesh, r->p.real, n, r->cut, n_triangles));
out:
    return st;
}

static enum imp_status sphere(struct rad_reader *r, struct rad_modifier *m,
                              const char *bsdf)
{
    enum imp_status st = IMP_OK;
    const struct imp_loc loc = imp__rad_loc(r);
    const double *v = r->p.real;
    struct imp_node *node;
    if (r->p.n_real != 4 || !(v[3] > 0))
        return imp__rad_error(r, "needs a centre and a radius above 0");
    IMP_TRY(shape_open(r, m, bsdf, "sphere", &node));
    IMP_TRY(imp__import_point(r->in, node, "center", v, loc));
    IMP_TRY(imp__import_float(r->in, node, "radius", v[3], loc));
    if (strcmp(r->p.type, "bubble") == 0)
        IMP_TRY(imp__import_bool(r->in, node, "flip_normals", true, loc));
out:
    return st;
}

static enum imp_status cylinder(struct rad_reader *r, struct rad_modifier *m,
                                const char *bsdf)
{
    enum imp_status st = IMP_OK;
    const struct imp_loc loc = imp__rad_loc(r);
    const double *v = r->p.real;
    struct imp_node *node;
    if (r->p.n_real != 7 || !(v[6] > 0) || memcmp(v, v + 3, 3 * sizeof *v) == 0)
        return imp__rad_error(r, "needs two different ends and a radius above 0");
    IMP_TRY(shape_open(r, m, bsdf, "cylinder", &node));
    IMP_TRY(imp__import_point(r->in, node, "p0", v, loc));
    IMP_TRY(imp__import_point(r->in, node, "p1", v + 3, loc));
    IMP_TRY(imp__import_float(r->in, node, "radius", v[6], loc));
    if (strcmp(r->p.type, "tube") == 0)
        IMP_TRY(imp__import_bool(r->in, node, "flip_normals", true, loc));
out:
    return st;
}

/* Two unit vectors u, v at right angles to the unit vector n, u x v = n. */
static void axes(const double n[3], double u[3], double v[3])
{
    int k = 0;
    for (int i = 1; i < 3; i++)
        if (fabs(n[i]) < fabs(n[k])) k = i;
    double length = 0;
    for (int i = 0; i < 3; i++) {
        u[i] = (i == k) - n[k] * n[i];
        length += u[i] * u[i];
    }
    for (int i = 0; i < 3; i++) u[i] /= sqrt(length);
    for (int i = 0; i < 3; i++) {
        const int a = (i + 1) % 3, b = (i + 2) % 3;
        v[i] = n[a] * u[b] - n[b] * u[a];
    }
}

/* A disk; with a hole, a band of triangles between polygons that have the circles' areas:
 * their corners are 4e-4 of the radius outside of it, their edges 2e-4 inside. */
static enum imp_status ring(struct rad_reader *r, struct rad_modifier *m,
                            const char *bsdf)
{
    enum imp_status st = IMP_OK;
    const struct imp_loc loc = imp__rad_loc(r);
    const double *v = r->p.real;
    double n[3], x[3], y[3];
    if (r->p.n_real != 8) return imp__rad_error(r, "needs 8 numbers");
    const double length = sqrt(v[3] * v[3] + v[4] * v[4] + v[5] * v[5]),
                 inner = fmin(v[6], v[7]), outer = fmax(v[6], v[7]);
    if (!(length > 0) || !isfinite(length) || inner < 0 || !(outer > inner))
        return imp__rad_error(r, "needs a centre, a direction and two different radii");
    for (int k = 0; k < 3; k++) n[k] = v[3 + k] / length;
    axes(n, x, y);
    if (inner == 0) {
        double to_world[16] = {0};
        struct imp_node *node;
        for (int k = 0; k < 3; k++) {
            to_world[4 * k] = outer * x[k];
            to_world[4 * k + 1] = outer * y[k];
            to_world[4 * k + 2] = n[k];
            to_world[4 * k + 3] = v[k];
        }
        to_world[15] = 1;
        IMP_TRY(shape_open(r, m, bsdf, "disk", &node));
        return imp__import_matrix(r->in, node, "to_world", to_world, loc);
    }
    double corner[RING_SEGMENTS * 2][3];
    uint32_t index[RING_SEGMENTS * 2][3];
    const double step = 2 * IMP_PI / RING_SEGMENTS, wider = sqrt(step / sin(step));
    for (uint32_t i = 0; i < RING_SEGMENTS; i++) {
        const uint32_t next = (i + 1) % RING_SEGMENTS;
        for (int side = 0; side < 2; side++) {
            const double radius = wider * (side ? outer : inner);
            for (int k = 0; k < 3; k++)
                corner[2 * i + side][k] =
                    v[k] + radius * (cos(step * i) * x[k] + sin(step * i) * y[k]);
        }
        memcpy(index[2 * i], (uint32_t[3]){2 * i, 2 * i + 1, 2 * next + 1},
               sizeof index[0]);
        memcpy(index[2 * i + 1], (uint32_t[3]){2 * i, 2 * next + 1, 2 * next},
               sizeof index[0]);
    }
    struct rad_mesh *mesh;
    IMP_TRY(mesh_of(r, m, bsdf, &mesh));
    IMP_TRY(mesh_add(r, mesh, corner[0], RING_SEGMENTS * 2, index[0], RING_SEGMENTS * 2));
out:
    return st;
}

enum imp_status imp__rad_surface(struct rad_reader *r)
{
    static const struct {
        const char *type;
        surface *make;
    } made[] = {{"polygon", polygon},   {"sphere", sphere}, {"bubble", sphere},
                {"cylinder", cylinder}, {"tube", cylinder}, {"ring", ring}};
    enum imp_status st = IMP_OK;
    surface *make = NULL;
    struct rad_modifier *m;
    const char *bsdf;
    for (size_t i = 0; i < imp_count(made); i++)
        if (strcmp(made[i].type, r->p.type) == 0) make = made[i].make;
    if (!make) {
        char what[2 * RAD_WORD_MAX];
        snprintf(what, sizeof what, "%.80s '%.80s'", r->p.type, r->p.id);
        return imp__unread_add(r->in, &r->unread, r->p.line, what, "it is left out");
    }
    IMP_TRY(imp__rad_look(r, &m, &bsdf));
    if (m) IMP_TRY(make(r, m, bsdf));
out:
    return st;
}
