/* SPDX-License-Identifier: Apache-2.0
 *
 * From the scene's shapes to polygons with a material and a light each. What has no place
 * in finite elements is refused here, by the shape's name. */
#include "elements.h"
#include "kind/sensor/receiver.h"
#include <string.h>

static enum imp_status no_memory(imp_elements *e)
{
    return imp__error(e->ctx, IMP_E_NOMEM, "out of memory for polygons");
}

/* The node that an object of the scene was made from, NULL: none. Trees may share nodes,
 * but have no circles: commit refuses them. */
static const struct imp_node *node_of(const struct imp_node *node, const void *object)
{
    if (!node || node->object == object) return node;
    for (size_t i = 0; i < node->n_children; i++) {
        const struct imp_node *found = node_of(node->children[i].node, object);
        if (found) return found;
    }
    return NULL;
}

enum imp_status imp__el_refused_at(const imp_elements *e, enum imp_status st,
                                   const void *object)
{
    char where[512];
    if (st != IMP_E_UNSUPPORTED || !object) return st;
    const struct imp_node *node = node_of(e->scene->root, object);
    if (!node || !node->loc.file) return st;
    return imp__error_prefix(e->ctx, st, "%s",
                             imp__loc_text(node->loc, where, sizeof where));
}

/* ---- Materials and overrides --------------------------------------------------- */

static const struct imp_elements_phong *phong_of(const imp_elements *e,
                                                 const struct imp_shape *s)
{
    const struct imp_elements_phong *found = NULL;
    for (size_t i = 0; i < e->opt.n_phong; i++)
        if (strcmp(e->opt.phong[i].shape, s->name) == 0) found = &e->opt.phong[i];
        else if (!found && s->emitter < 0 && strcmp(e->opt.phong[i].shape, "*") == 0)
            found = &e->opt.phong[i];
    return found;
}

static bool reflects_behind(const struct imp_bsdf *b)
{
    imp_spec in[IMP_INPUTS_MAX], f;
    if (!(b->flags & IMP_BSDF_SMOOTH)) return false;
    for (int j = 0; j < b->n_in; j++) /* textures are refused later, by name */
        in[j] = b->input[j]->texture ? imp__spec(0.5) : b->input[j]->value;
    for (int k = 1; k < 8; k++) {
        const double z = -k / 8.0, x = sqrt(1 - z * z);
        const struct imp_dirs d = {imp__v3(x, 0, z), imp__v3(-x * cos(k), x * sin(k), z),
                                   IMP_SMOOTH, 0};
        b->ops->eval(b, in, &d, &f);
        if (!imp__is_zero(f)) return true;
    }
    return false;
}

enum imp_status imp__el_root_append(imp_elements *e, const struct imp__el_root *r,
                                    int *index)
{
    struct imp__el_root *grown =
        imp__grow(e->ctx, e->roots, &e->cap_roots, e->n_roots + 1, sizeof *grown);
    if (!grown || e->n_roots > INT32_MAX / 2) return no_memory(e);
    e->roots = grown;
    *index = (int)e->n_roots;
    grown[e->n_roots++] = *r;
    return IMP_OK;
}

/* One polygon: its front, and its back if that reflects or shines. */
static enum imp_status polygon_add(imp_elements *e, const struct imp_shape *s,
                                   int corners, const imp_v3 *v, imp_v3 normal,
                                   int *index)
{
    enum imp_status st = IMP_OK;
    const struct imp_bsdf *b = imp__shape_bsdf(e->scene, s);
    const struct imp_elements_phong *p = phong_of(e, s);
    for (int side = 0; side < 2; side++) {
        struct imp__el_root r = {
            .shape = s->index, .corners = corners, .light_param = -1, .back = -1};
        struct imp__el_material m = {.bsdf = p ? NULL : b, .flipped = side};
        const imp_v3 n = side ? -normal : normal;
        int made = -1;
        if (side && (p || !reflects_behind(b))) break;
        r.frame = imp__frame_from_normal(n);
        imp_v3 sum = imp__v3(0, 0, 0);
        for (int k = 1; k + 1 < corners; k++)
            sum += imp__cross(v[k] - v[0], v[k + 1] - v[0]);
        const bool reverse = imp__dot(sum, n) < 0;
        for (int k = 0; k < corners; k++)
            r.v[k] = v[reverse ? (corners - k) % corners : k];
        r.area = imp__length(sum) / 2;
        if (p && side == 0) {
            m.phong = true;
            m.label = p->shape;
            m.exponent = p->exponent;
            memcpy(m.kd, p->kd, sizeof m.kd);
            memcpy(m.ks, p->ks, sizeof m.ks);
        }
        IMP_TRY(imp__el_material_add(e, &m, &r.material));
        if (s->emitter >= 0 && side == 0) IMP_TRY(imp__el_emitter_take(e, s, &r));
        if (!p && (b->flags & IMP_BSDF_EMIT))
            IMP_TRY(imp__el_ambient_take(e, s, b, side, &r));
        for (size_t i = 0; i < e->opt.n_beams && side == 0 && r.light != EL_DARK; i++) {
            const struct imp_elements_beam *beam = &e->opt.beams[i];
            if (strcmp(beam->shape, s->name) != 0) continue;
            const imp_v3 axis = imp__v3(beam->axis[0], beam->axis[1], beam->axis[2]);
            const double length = imp__length(axis);
            r.light = EL_LOBE;
            r.axis = length > 0 ? axis * (1 / length) : n;
            r.power = beam->exponent;
            r.power_input = NULL;
        }
        IMP_TRY(imp__el_root_append(e, &r, &made));
        if (side == 0) *index = made;
        else e->roots[*index].back = made, e->roots[made].back = *index;
    }
out:
    return st;
}

/* ---- Polygons of a shape ------------------------------------------------------- */

static void corners_of(const struct imp_shape *s, int prim, imp_v3 v[3], imp_v3 *ng,
                       bool *smooth)
{
    static const double uv[3][2] = {{0, 0}, {1, 0}, {0, 1}};
    for (int k = 0; k < 3; k++) {
        struct imp_surface at;
        const struct imp_hit hit = {
            .shape = s->index, .prim = prim, .u = uv[k][0], .v = uv[k][1]};
        s->ops->surface(s, &hit, &(imp_v3){0}, &(imp_v3){0}, &at);
        v[k] = at.p;
        *ng = at.ng;
        *smooth |= imp__dot(at.n, at.ng) < 1 - 1e-4;
    }
}

/* Two triangles that share an edge, lie in one plane and make a convex quadrilateral. */
static bool quad_of(const imp_v3 a[3], imp_v3 na, const imp_v3 b[3], imp_v3 nb,
                    imp_v3 quad[4])
{
    int shared[3] = {-1, -1, -1}, count = 0, lone = 0;
    double size = 0;
    if (imp__dot(na, nb) < 1 - 1e-9) return false;
    for (int k = 0; k < 3; k++) size = fmax(size, imp__length(a[k] - a[(k + 1) % 3]));
    for (int j = 0; j < 3; j++) {
        bool found = false;
        for (int k = 0; k < 3; k++)
            if (imp__length(a[k] - b[j]) <= 1e-9 * size) shared[k] = j, found = true;
        count += found;
        if (!found) lone = j;
    }
    if (count != 2) return false;
    if (fabs(imp__dot(b[lone] - a[0], na)) > 1e-7 * size) return false;
    int n = 0;
    for (int k = 0; k < 3; k++) {
        quad[n++] = a[k];
        if (shared[k] >= 0 && shared[(k + 1) % 3] >= 0) quad[n++] = b[lone];
    }
    if (n != 4) return false;
    for (int k = 0; k < 4; k++) { /* every corner turns the same way, and clearly */
        const imp_v3 c = imp__cross(quad[(k + 1) % 4] - quad[k],
                                    quad[(k + 2) % 4] - quad[(k + 1) % 4]);
        if (imp__dot(c, na) *
                (imp__dot(imp__cross(a[1] - a[0], a[2] - a[0]), na) < 0 ? -1 : 1) <
            1e-6 * size * size)
            return false;
    }
    return true;
}

static enum imp_status shape_take(imp_elements *e, const struct imp_shape *s,
                                  int *prim_root)
{
    enum imp_status st = IMP_OK;
    bool smooth = false;
    const int n = (int)s->triangles.n_triangles;
    for (int t = 0; t < n; t++) {
        imp_v3 a[3], b[3], quad[4], na, nb;
        bool joined = false;
        corners_of(s, t, a, &na, &smooth);
        prim_root[t] = -1;
        double longest = 0;
        for (int k = 0; k < 3; k++)
            longest = fmax(longest, imp__length(a[k] - a[(k + 1) % 3]));
        if (!(imp__polygon_area(3, a) > 1e-14 * longest * longest)) {
            e->skipped++;
            continue;
        }
        if (t + 1 < n) {
            corners_of(s, t + 1, b, &nb, &smooth);
            joined = quad_of(a, na, b, nb, quad);
        }
        IMP_TRY(polygon_add(e, s, joined ? 4 : 3, joined ? quad : a, na, &prim_root[t]));
        if (joined) prim_root[t + 1] = prim_root[t], t++;
    }
    if (smooth && !e->quiet)
        imp__warn(e->ctx,
                  "shape '%s': finite elements see its faces flat, without the "
                  "interpolated normals",
                  s->name);
out:
    return st;
}

static bool name_is_shape(const imp_elements *e, const char *name)
{
    for (int i = 0; i < e->scene->n_shapes; i++)
        if (strcmp(e->scene->shapes[i]->name, name) == 0) return true;
    return false;
}

enum imp_status imp__el_roots(imp_elements *e)
{
    enum imp_status st = IMP_OK;
    const struct imp_scene *scene = e->scene;
    if (scene->world)
        IMP_TRY(imp__error(e->ctx, IMP_E_UNSUPPORTED,
                           "the scene has instances: finite elements keep numbers for "
                           "each place, and take shapes that are placed by themselves"));
    for (int i = 0; i < scene->n_emitters; i++)
        if (scene->emitters[i]->course)
            IMP_TRY(imp__error(e->ctx, IMP_E_UNSUPPORTED,
                               "emitter '%s' varies in time: finite elements have one "
                               "time",
                               scene->emitters[i]->name));
    for (int i = 0; i < scene->n_emitters; i++)
        if (!(scene->emitters[i]->ops->flags & IMP_EMITTER_AREA) ||
            scene->emitters[i]->ops->flags & IMP_EMITTER_DELTA)
            IMP_TRY(imp__el_refused_at(
                e,
                imp__error(
                    e->ctx, IMP_E_UNSUPPORTED,
                    "emitter '%s' (%s): finite elements take lights that are surfaces "
                    "and shine in all directions",
                    scene->emitters[i]->name, scene->emitters[i]->ops->name),
                scene->emitters[i]));
    for (size_t i = 0; i < e->opt.n_phong; i++)
        if (strcmp(e->opt.phong[i].shape, "*") != 0 &&
            !name_is_shape(e, e->opt.phong[i].shape))
            IMP_TRY(imp__error(e->ctx, IMP_E_ARG, "there is no shape '%s' to make glossy",
                               e->opt.phong[i].shape));
    for (size_t i = 0; i < e->opt.n_beams; i++)
        if (!name_is_shape(e, e->opt.beams[i].shape))
            IMP_TRY(imp__error(e->ctx, IMP_E_ARG, "there is no shape '%s' to direct",
                               e->opt.beams[i].shape));
    e->prim_root =
        imp__arena_array(&e->arena, (size_t)scene->n_shapes + 1, sizeof *e->prim_root);
    if (!e->prim_root) IMP_TRY(no_memory(e));
    for (int i = 0; i < scene->n_shapes; i++) {
        const struct imp_shape *s = scene->shapes[i];
        if (imp__shape_is_absent(s)) continue;
        if (s->geometry != IMP_TRIANGLES)
            IMP_TRY(imp__el_refused_at(
                e,
                imp__error(e->ctx, IMP_E_UNSUPPORTED,
                           "shape '%s' (%s): finite elements take rectangles, cubes and "
                           "meshes",
                           s->name, s->ops->name),
                s));
        e->prim_root[i] =
            imp__arena_array(&e->arena, s->triangles.n_triangles + 1, sizeof(int));
        if (!e->prim_root[i]) IMP_TRY(no_memory(e));
        IMP_TRY(imp__el_refused_at(e, shape_take(e, s, e->prim_root[i]), s));
    }
    if (e->n_roots == 0)
        IMP_TRY(
            imp__error(e->ctx, IMP_E_SCENE, "the scene has no surfaces with an area"));
    for (size_t i = 0; i < e->n_sources; i++) {
        const struct imp_elements_source *src = &e->sources[i];
        if (src->kind == IMP_ELEMENTS_PLANE) IMP_TRY(imp__el_plane_add(e, src));
        if (src->kind == IMP_ELEMENTS_SHAPE) IMP_TRY(imp__el_measure_shape(e, src));
    }
    double *w = imp__arena_array(&e->arena, e->n_sources, sizeof *w);
    if (!w) IMP_TRY(no_memory(e));
    for (size_t i = 0; i < e->n_sources; i++) w[i] = e->sources[i].weight;
    imp__el_weigh(e, w);
out:
    return st;
}
