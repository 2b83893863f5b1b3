/* SPDX-License-Identifier: Apache-2.0
 *
 * The tree of nodes: meshes as shapes with their world transform, cameras as sensors,
 * KHR_lights_punctual as emitters. glTF looks along -z with x to the right, a sensor of
 * ours along +z with x to the left. */
#include "gltf.h"
#include <math.h>
#include <stdio.h>
#include <string.h>

#define DEPTH_MAX 1000 /* nodes inside nodes */

/* ---- Transforms --------------------------------------------------------------------------- */

static void rotation(const double q[4], struct imp_mat4 *out)
{
    const double x = q[0], y = q[1], z = q[2], w = q[3];
    *out = (struct imp_mat4){{1 - 2 * (y * y + z * z), 2 * (x * y - z * w),
                              2 * (x * z + y * w), 0, 2 * (x * y + z * w),
                              1 - 2 * (x * x + z * z), 2 * (y * z - x * w), 0,
                              2 * (x * z - y * w), 2 * (y * z + x * w),
                              1 - 2 * (x * x + y * y), 0, 0, 0, 0, 1}};
}

static enum imp_status local_of(struct gltf *g, const json_t *node, struct imp_mat4 *out)
{
    double m[16], t[3] = {0, 0, 0}, q[4] = {0, 0, 0, 1}, s[3] = {1, 1, 1}, length = 0;
    struct imp_mat4 turned;
    if (json_object_get(node, "matrix")) { /* by columns */
        IMP_CHECKED(imp__gltf_numbers(g, node, "matrix", 16, m));
        for (int i = 0; i < 4; i++)
            for (int j = 0; j < 4; j++) out->m[4 * i + j] = m[4 * j + i];
        if (!imp__mat4_is_affine(out)) return imp__gltf_error(g, "matrix is not affine");
        return IMP_OK;
    }
    IMP_CHECKED(imp__gltf_numbers(g, node, "translation", 3, t));
    IMP_CHECKED(imp__gltf_numbers(g, node, "rotation", 4, q));
    IMP_CHECKED(imp__gltf_numbers(g, node, "scale", 3, s));
    for (int k = 0; k < 4; k++) length += q[k] * q[k];
    if (!(length > 0) || !isfinite(length))
        return imp__gltf_error(g, "rotation is no quaternion");
    for (int k = 0; k < 4; k++) q[k] /= sqrt(length);
    rotation(q, &turned);
    *out = imp__translate(imp__v3(t[0], t[1], t[2]));
    *out = imp__mat4_multiply(out, &turned);
    turned = imp__scale(imp__v3(s[0], s[1], s[2]));
    *out = imp__mat4_multiply(out, &turned);
    return IMP_OK;
}

/* What looks from a node along its -z: without its scale. */
static enum imp_status look_of(struct gltf *g, const struct imp_mat4 *world,
                               struct imp_mat4 *out)
{
    const imp_v3 at = imp__point(world, imp__v3(0, 0, 0)),
                 to = at - imp__vector(world, imp__v3(0, 0, 1)),
                 up = imp__vector(world, imp__v3(0, 1, 0));
    if (!imp__lookat(at, to, up, out))
        return imp__gltf_error(g, "its transform is singular");
    return IMP_OK;
}

/* ---- Meshes --------------------------------------------------------------------------------- */

static void box_add(struct gltf *g, const struct gltf_primitive *p,
                    const struct imp_mat4 *world)
{
    for (int i = 0; i < 8; i++) {
        const imp_v3 c = imp__point(world, imp__v3(i & 1 ? p->hi[0] : p->lo[0],
                                                   i & 2 ? p->hi[1] : p->lo[1],
                                                   i & 4 ? p->hi[2] : p->lo[2]));
        for (int k = 0; k < 3; k++) {
            g->lo[k] = fmin(g->lo[k], c[k]);
            g->hi[k] = fmax(g->hi[k], c[k]);
        }
    }
}

static enum imp_status glow(struct gltf *g, const struct gltf_material *m,
                            struct imp_node *shape)
{
    struct imp_node *light;
    if (!(m->emitted[0] > 0 || m->emitted[1] > 0 || m->emitted[2] > 0)) return IMP_OK;
    IMP_CHECKED(imp__tree_open(g->in->tree, shape, "emitter", "area", NULL, NULL, g->loc,
                               &light));
    g->n_lamps++;
    if (m->emitted_texture)
        return imp__tree_ref(g->in->tree, light, m->emitted_texture, "radiance", g->loc);
    return imp__import_rgb(g->in, light, "radiance", m->emitted, g->loc);
}

static enum imp_status mesh_place(struct gltf *g, const json_t *node, size_t index,
                                  size_t mesh, const struct imp_mat4 *world)
{
    struct gltf_mesh *m;
    struct gltf_material *material;
    struct imp_node *shape;
    IMP_CHECKED(imp__gltf_mesh(g, mesh, &m));
    IMP_CHECKED(imp__gltf_item(g, "nodes", index, &node));
    if (json_object_get(node, "skin"))
        IMP_CHECKED(
            imp__gltf_unread(g, "the mesh is as without it", "%s: skin", g->where));
    const double det = imp__mat4_det3(world);
    if (!(fabs(det) > 0) || !isfinite(det)) {
        imp__warn(g->ctx, "%s: %s: has no volume, and is left out", g->in->name,
                  g->where);
        return IMP_OK;
    }
    const json_t *named = imp__gltf_text(node, "name")
                              ? node
                              : json_array_get(json_object_get(g->root, "meshes"), mesh);
    for (size_t i = 0; i < m->n; i++) {
        const struct gltf_primitive *p = &m->primitive[i];
        if (!p->mesh) continue;
        IMP_CHECKED(imp__gltf_material(g, p->material, &material));
        const char *id = imp__gltf_id(g, named, "mesh", mesh);
        if (!id) return imp__gltf_memory(g);
        IMP_CHECKED(imp__tree_open(g->in->tree, g->in->parent, "shape", "mesh", id, NULL,
                                   g->loc, &shape));
        shape->mesh = p->mesh;
        if (!p->mesh->normals)
            IMP_CHECKED(imp__import_bool(g->in, shape, "face_normals", true, g->loc));
        IMP_CHECKED(imp__import_matrix(g->in, shape, "to_world", world->m, g->loc));
        IMP_CHECKED(imp__tree_ref(g->in->tree, shape, material->id, NULL, g->loc));
        IMP_CHECKED(glow(g, material, shape));
        box_add(g, p, world);
    }
    return IMP_OK;
}

/* ---- Cameras ---------------------------------------------------------------------------------- */

static enum imp_status perspective(struct gltf *g, const json_t *lens, const char *id,
                                   const struct imp_mat4 *look)
{
    double fov = .8, aspect = 4. / 3;
    struct imp_node *sensor;
    IMP_CHECKED(imp__gltf_number(g, lens, "yfov", 1e-6, 3.14, &fov));
    IMP_CHECKED(imp__gltf_number(g, lens, "aspectRatio", 1e-4, 1e4, &aspect));
    IMP_CHECKED(imp__tree_open(g->in->tree, g->in->parent, "sensor", "perspective", id,
                               NULL, g->loc, &sensor));
    IMP_CHECKED(imp__import_matrix(g->in, sensor, "to_world", look->m, g->loc));
    IMP_CHECKED(imp__import_string(g->in, sensor, "fov_axis", "y", g->loc));
    IMP_CHECKED(imp__import_float(g->in, sensor, "fov", fov * 180 / IMP_PI, g->loc));
    return imp__import_film(g->in, sensor, aspect, g->loc);
}

static enum imp_status orthographic(struct gltf *g, const json_t *lens, const char *id,
                                    const struct imp_mat4 *look)
{
    double x = 1, y = 1;
    struct imp_node *sensor;
    IMP_CHECKED(imp__gltf_number(g, lens, "xmag", 1e-12, 1e12, &x));
    IMP_CHECKED(imp__gltf_number(g, lens, "ymag", 1e-12, 1e12, &y));
    struct imp_mat4 m = imp__scale(imp__v3(x, x, 1)); /* y: by the film's aspect ratio */
    m = imp__mat4_multiply(look, &m);
    IMP_CHECKED(imp__tree_open(g->in->tree, g->in->parent, "sensor", "orthographic", id,
                               NULL, g->loc, &sensor));
    IMP_CHECKED(imp__import_matrix(g->in, sensor, "to_world", m.m, g->loc));
    return imp__import_film(g->in, sensor, x / y, g->loc);
}

static enum imp_status camera_place(struct gltf *g, size_t index,
                                    const struct imp_mat4 *world)
{
    const json_t *camera;
    struct imp_mat4 look;
    IMP_CHECKED(look_of(g, world, &look));
    IMP_CHECKED(imp__gltf_item(g, "cameras", index, &camera));
    const char *id = imp__gltf_id(g, camera, "camera", index);
    if (!id) return imp__gltf_memory(g);
    g->n_cameras++;
    const json_t *flat = json_object_get(camera, "orthographic");
    return flat ? orthographic(g, flat, id, &look)
                : perspective(g, json_object_get(camera, "perspective"), id, &look);
}

/* ---- Lights ------------------------------------------------------------------------------------ */

static enum imp_status spot(struct gltf *g, const json_t *object, struct imp_node *light,
                            const struct imp_mat4 *world)
{
    double inner = 0, outer = IMP_PI / 4;
    struct imp_mat4 look;
    const json_t *cone = json_object_get(object, "spot");
    IMP_CHECKED(imp__gltf_number(g, cone, "outerConeAngle", 0, IMP_PI / 2, &outer));
    IMP_CHECKED(imp__gltf_number(g, cone, "innerConeAngle", 0, outer, &inner));
    IMP_CHECKED(look_of(g, world, &look));
    IMP_CHECKED(imp__import_matrix(g->in, light, "to_world", look.m, g->loc));
    IMP_CHECKED(
        imp__import_float(g->in, light, "cutoff_angle", outer * 180 / IMP_PI, g->loc));
    return imp__import_float(g->in, light, "beam_width", inner * 180 / IMP_PI, g->loc);
}

/* Candelas and luxes, times the efficacy (KHR_lights_punctual). */
static enum imp_status light_place(struct gltf *g, size_t index,
                                   const struct imp_mat4 *world)
{
    static const struct {
        const char *kind, *type, *value;
    } kinds[] = {{"point", "point", "intensity"},
                 {"spot", "spot", "intensity"},
                 {"directional", "directional", "irradiance"}};
    double color[3] = {1, 1, 1}, intensity = 1, v[3];
    struct imp_node *light;
    snprintf(g->where, sizeof g->where, "KHR_lights_punctual.lights[%zu]", index);
    const json_t *object = json_array_get(
        json_object_get(imp__gltf_extension(g->root, "KHR_lights_punctual"), "lights"),
        index);
    const char *kind = imp__gltf_text(object, "type");
    int k = -1;
    for (int i = 0; kind && i < (int)imp_count(kinds); i++)
        if (strcmp(kinds[i].kind, kind) == 0) k = i;
    if (k < 0) return imp__gltf_error(g, "type '%.40s'", kind ? kind : "");
    IMP_CHECKED(imp__gltf_numbers(g, object, "color", 3, color));
    IMP_CHECKED(imp__gltf_number(g, object, "intensity", 0, 1e20, &intensity));
    for (int c = 0; c < 3; c++) color[c] *= intensity * g->efficacy;
    const char *id = imp__gltf_id(g, object, "light", index);
    if (!id) return imp__gltf_memory(g);
    g->n_lamps++;
    IMP_CHECKED(imp__tree_open(g->in->tree, g->in->parent, "emitter", kinds[k].type, id,
                               NULL, g->loc, &light));
    IMP_CHECKED(imp__import_rgb(g->in, light, kinds[k].value, color, g->loc));
    if (k == 1) return spot(g, object, light, world);
    const imp_v3 at = k == 0 ? imp__point(world, imp__v3(0, 0, 0))
                             : imp__vector(world, imp__v3(0, 0, -1));
    for (int c = 0; c < 3; c++) v[c] = at[c];
    return imp__import_point(g->in, light, k == 0 ? "position" : "direction", v, g->loc);
}

/* ---- The tree ------------------------------------------------------------------------------------ */

static enum imp_status node_place(struct gltf *g, size_t index,
                                  const struct imp_mat4 *parent, int depth)
{
    const json_t *node;
    struct imp_mat4 world;
    int mesh, camera, light;
    IMP_CHECKED(imp__gltf_item(g, "nodes", index, &node));
    if (g->visited[index]) return imp__gltf_error(g, "is in the tree twice");
    if (depth > DEPTH_MAX)
        return imp__gltf_error(g, "nodes are nested deeper than %d", DEPTH_MAX);
    g->visited[index] = true;
    IMP_CHECKED(local_of(g, node, &world));
    world = imp__mat4_multiply(parent, &world);
    if (!imp__mat4_is_finite(&world))
        return imp__gltf_error(g, "its transform overflows");
    const json_t *list =
        json_object_get(imp__gltf_extension(g->root, "KHR_lights_punctual"), "lights");
    IMP_CHECKED(imp__gltf_index(g, node, "mesh", g->n_meshes, &mesh));
    IMP_CHECKED(
        imp__gltf_index(g, node, "camera", imp__gltf_count(g, "cameras"), &camera));
    IMP_CHECKED(imp__gltf_index(g, imp__gltf_extension(node, "KHR_lights_punctual"),
                                "light", json_array_size(list), &light));
    if (imp__gltf_extension(node, "EXT_mesh_gpu_instancing"))
        IMP_CHECKED(
            imp__gltf_unread(g, "there is one", "%s: EXT_mesh_gpu_instancing", g->where));
    if (mesh >= 0) IMP_CHECKED(mesh_place(g, node, index, (size_t)mesh, &world));
    if (camera >= 0) IMP_CHECKED(camera_place(g, (size_t)camera, &world));
    if (light >= 0) IMP_CHECKED(light_place(g, (size_t)light, &world));
    const json_t *children = json_object_get(node, "children");
    for (size_t i = 0; i < json_array_size(children); i++) {
        const json_t *child = json_array_get(children, i);
        const json_int_t at = json_is_integer(child) ? json_integer_value(child) : -1;
        snprintf(g->where, sizeof g->where, "nodes[%zu]", index);
        if (at < 0 || (size_t)at >= g->n_nodes)
            return imp__gltf_error(g, "child %zu is no node", i);
        IMP_CHECKED(node_place(g, (size_t)at, &world, depth + 1));
    }
    return IMP_OK;
}

/* Nodes of the scene; of a file without scenes those that are nobody's children. */
static enum imp_status roots(struct gltf *g, bool *inner)
{
    const struct imp_mat4 none = imp__mat4_identity();
    const json_t *scene;
    int index;
    g->where[0] = 0;
    IMP_CHECKED(
        imp__gltf_index(g, g->root, "scene", imp__gltf_count(g, "scenes"), &index));
    if (imp__gltf_count(g, "scenes") > 0) {
        IMP_CHECKED(imp__gltf_item(g, "scenes", (size_t)imp_max(index, 0), &scene));
        const json_t *list = json_object_get(scene, "nodes");
        for (size_t i = 0; i < json_array_size(list); i++) {
            const json_t *node = json_array_get(list, i);
            const json_int_t at = json_is_integer(node) ? json_integer_value(node) : -1;
            if (at < 0 || (size_t)at >= g->n_nodes)
                return imp__gltf_error(g, "its node %zu is no node", i);
            IMP_CHECKED(node_place(g, (size_t)at, &none, 0));
        }
        return IMP_OK;
    }
    for (size_t i = 0; i < g->n_nodes; i++) {
        const json_t *children = json_object_get(
            json_array_get(json_object_get(g->root, "nodes"), i), "children");
        for (size_t k = 0; k < json_array_size(children); k++) {
            const json_int_t at = json_integer_value(json_array_get(children, k));
            if (at >= 0 && (size_t)at < g->n_nodes) inner[at] = true;
        }
    }
    for (size_t i = 0; i < g->n_nodes; i++)
        if (!inner[i]) IMP_CHECKED(node_place(g, i, &none, 0));
    return IMP_OK;
}

enum imp_status imp__gltf_nodes(struct gltf *g)
{
    bool *inner = imp__arena_array(&g->in->scene->files, g->n_nodes + 1, sizeof *inner);
    if (!inner) return imp__gltf_memory(g);
    IMP_CHECKED(roots(g, inner));
    if (imp__gltf_count(g, "animations") > 0)
        imp__warn(g->ctx, "%s: animations are not read: nodes are where they stand",
                  g->in->name);
    if (!g->in->alone) return IMP_OK;
    if (!g->n_cameras) IMP_CHECKED(imp__import_camera(g->in, g->lo, g->hi, g->loc));
    return g->n_lamps ? IMP_OK : imp__import_sky(g->in, g->loc);
}
