/* SPDX-License-Identifier: Apache-2.0
 *
 * From the scene's shapes to polygons with a material and a light each. What has no place
 * in finite elements is refused here, by the shape's name. */
#include "elements.h"
#include "kind/emitter/beam.h"
#include <string.h>

static enum imp_status no_memory(imp_elements *e)
{
    return imp__error(e->ctx, IMP_E_NOMEM, "out of memory for polygons");
}

enum imp_status imp__el_material_add(imp_elements *e, const struct imp__el_material *m,
                                     int *index)
{
    for (int i = 0; i < e->n_materials; i++) {
        const struct imp__el_material *k = &e->materials[i];
        if (k->bsdf == m->bsdf && k->flipped == m->flipped && k->phong == m->phong &&
            memcmp(k->kd, m->kd, sizeof m->kd) == 0 &&
            memcmp(k->ks, m->ks, sizeof m->ks) == 0 && k->exponent == m->exponent) {
            *index = i;
            return IMP_OK;
        }
    }
    const size_t n = (size_t)e->n_materials;
    if ((n & (n - 1)) == 0) { /* full */
        struct imp__el_material *grown =
            imp__arena_array(&e->arena, n ? 2 * n : 1, sizeof *grown);
        if (!grown) return no_memory(e);
        if (n) memcpy(grown, e->materials, n * sizeof *grown);
        e->materials = grown;
    }
    e->materials[n] = *m;
    *index = e->n_materials++;
    return IMP_OK;
}

/* ---- Lights -------------------------------------------------------------------- */

static double channels_apart(imp_spec a, imp_spec b, int ch)
{
    double d = 0;
    for (int c = 0; c < ch; c++) d = fmax(d, fabs(a[c] - b[c]) / (1e-12 + fabs(a[c])));
    return d;
}

static void light_set(struct imp__el_root *r, const struct imp_input *in,
                      const char *name)
{
    r->light = EL_UNIFORM;
    r->light_param = in->param;
    r->light_count = in->count;
    r->light_name = name;
    for (int c = 0; c < 3; c++) r->light_value[c] = r->radiance[c] = in->value[c];
}

static enum imp_status emitter_take(imp_elements *e, const struct imp_shape *s,
                                    struct imp__el_root *r)
{
    const struct imp_emitter *em = e->scene->emitters[s->emitter];
    bool textured = em->n_in < 1;
    for (int j = 0; j < em->n_in; j++) textured |= em->input[j]->texture != NULL;
    if (textured)
        return imp__error(
            e->ctx, IMP_E_UNSUPPORTED,
            "shape '%s': its light (%s) has a texture, which finite elements "
            "cannot project",
            s->name, em->ops->name);
    imp_spec in[8];
    if (em->n_in > 8)
        return imp__error(e->ctx, IMP_E_UNSUPPORTED,
                          "shape '%s': its light (%s) "
                          "has too many inputs",
                          s->name, em->ops->name);
    imp__inputs_eval(em->input, em->n_in, &(struct imp_texcoord){.uv = {0.5, 0.5}}, in);
    if (em->ops == &imp__beam_light) {
        const struct imp__beam *beam = em->self;
        light_set(r, em->input[0], em->name);
        r->light = EL_LOBE;
        r->axis = beam->aimed ? beam->axis : r->frame.n;
        r->power_input = em->input[IMP_BEAM_EXPONENT];
        r->power = in[IMP_BEAM_EXPONENT][0];
        return IMP_OK;
    }
    if (em->ops == &imp__ies_area) {
        light_set(r, em->input[0], em->name);
        r->light = EL_TABLE;
        r->table = em->self;
        r->power = imp__ies_mean(r->table, r->frame.n);
        return IMP_OK;
    }
    for (int k = 1; k < 16; k++) {
        const double z = k / 16.0, x = sqrt(1 - z * z);
        const struct imp_emission at = {.uv = {0.1 * (k % 7), 0.06 * k},
                                        .dist = 1,
                                        .cos_light = z,
                                        .d = r->frame.s * (x * cos(k)) +
                                             r->frame.t * (x * sin(k)) + r->frame.n * z};
        imp_spec le;
        em->ops->eval(em, in, &at, &le);
        if (channels_apart(in[0], le, e->ch) > 1e-9)
            return imp__error(
                e->ctx, IMP_E_UNSUPPORTED,
                "shape '%s': its light (%s) is not the same in all directions and "
                "places; finite elements cannot project it",
                s->name, em->ops->name);
    }
    light_set(r, em->input[0], em->name);
    return IMP_OK;
}

/* Stam's ambient terms: what the material itself emits. */
static enum imp_status ambient_take(imp_elements *e, const struct imp_shape *s,
                                    const struct imp_bsdf *b, bool flipped,
                                    struct imp__el_root *r)
{
    imp_spec in[64], emitted, first = {0}, d[64];
    int source = -1;
    imp__inputs_eval(b->input, b->n_in, &(struct imp_texcoord){.uv = {0.5, 0.5}}, in);
    for (int k = 1; k < 16; k++) {
        const double z = k / 16.0, x = sqrt(1 - z * z);
        const imp_v3 wo = imp__v3(x * cos(k), x * sin(k), flipped ? -z : z);
        b->ops->emit(b, in, &wo, &emitted);
        if (k == 1) first = emitted;
        if (channels_apart(first, emitted, e->ch) > 1e-9)
            return imp__error(
                e->ctx, IMP_E_UNSUPPORTED,
                "shape '%s': what its material emits "
                "depends on the direction; finite elements cannot project it",
                s->name);
        b->ops->emit_d(b, in, &wo, d);
    }
    for (int j = 0; j < b->n_in; j++)
        if (d[j][0] == 1 && channels_apart(first, in[j], e->ch) == 0) source = j;
    if (source < 0) return IMP_OK; /* nothing comes out on this side */
    if (imp__is_zero(first) && r->light != EL_DARK) return IMP_OK;
    if (r->light != EL_DARK)
        return imp__error(e->ctx, IMP_E_UNSUPPORTED,
                          "shape '%s': light of its own and an ambient term together",
                          s->name);
    light_set(r, b->input[source], b->name);
    return IMP_OK;
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
    imp_spec in[64], f;
    if (b->n_in > 64 || !(b->flags & IMP_BSDF_SMOOTH)) return false;
    for (int j = 0; j < b->n_in; j++) /* textures are refused later, by name */
        in[j] = b->input[j]->texture ? imp__spec(0.5) : b->input[j]->value;
    for (int k = 1; k < 8; k++) {
        const double z = -k / 8.0, x = sqrt(1 - z * z);
        const struct imp_dirs d = {imp__v3(x, 0, z), imp__v3(-x * cos(k), x * sin(k), z),
                                   IMP_SMOOTH};
        b->ops->eval(b, in, &d, &f);
        if (!imp__is_zero(f)) return true;
    }
    return false;
}

static enum imp_status root_append(imp_elements *e, const struct imp__el_root *r,
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
        if (s->emitter >= 0 && side == 0) IMP_TRY(emitter_take(e, s, &r));
        if (!p && (b->flags & IMP_BSDF_EMIT) && b->n_in <= 64)
            IMP_TRY(ambient_take(e, s, b, side, &r));
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
        IMP_TRY(root_append(e, &r, &made));
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
    if (smooth)
        imp__warn(e->ctx,
                  "shape '%s': finite elements see its faces flat, without the "
                  "interpolated normals",
                  s->name);
out:
    return st;
}

static enum imp_status plane_add(imp_elements *e, const struct imp_elements_source *src)
{
    const imp_v3 o = imp__v3(src->origin[0], src->origin[1], src->origin[2]);
    const imp_v3 u = imp__v3(src->edge_u[0], src->edge_u[1], src->edge_u[2]);
    const imp_v3 v = imp__v3(src->edge_v[0], src->edge_v[1], src->edge_v[2]);
    struct imp__el_root r = {.shape = -1,
                             .corners = 4,
                             .light_param = -1,
                             .back = -1,
                             .v = {o, o + u, o + u + v, o + v}};
    const imp_v3 c = imp__cross(u, v);
    int index;
    r.area = imp__length(c);
    if (!(r.area > 0) || !isfinite(r.area))
        return imp__error(e->ctx, IMP_E_ARG, "a measuring plane has area %g", r.area);
    r.frame = imp__frame_from_normal(c * (1 / r.area));
    r.measured = true;
    const enum imp_status st =
        imp__el_material_add(e, &(struct imp__el_material){.bsdf = NULL}, &r.material);
    return st == IMP_OK ? root_append(e, &r, &index) : st;
}

/* Is the root a front of the shape that this source measures? */
static bool is_measured(const imp_elements *e, const struct imp__el_root *r,
                        const struct imp_elements_source *src)
{
    if (r->shape < 0 || strcmp(e->scene->shapes[r->shape]->name, src->shape) != 0)
        return false;
    return r->back < 0 || &e->roots[r->back] > r; /* a back comes after its front */
}

static enum imp_status measure_shape(imp_elements *e,
                                     const struct imp_elements_source *src)
{
    bool found = false;
    for (size_t i = 0; i < e->n_roots; i++)
        if (is_measured(e, &e->roots[i], src)) found = e->roots[i].measured = true;
    if (!found)
        return imp__error(e->ctx, IMP_E_ARG, "there is no shape '%s' to measure",
                          src->shape);
    return IMP_OK;
}

void imp__el_weigh(imp_elements *e, const double *w)
{
    size_t plane = 0; /* their roots are the last, in the sources' order */
    while (plane < e->n_roots && e->roots[plane].shape >= 0) plane++;
    for (size_t i = 0; i < e->n_roots; i++) e->roots[i].measure = 0;
    for (size_t k = 0; k < e->n_sources; k++) {
        const struct imp_elements_source *src = &e->sources[k];
        if (src->kind == IMP_ELEMENTS_CAMERA) {
            size_t n = 0;
            for (size_t i = 0; i < e->n_hits; i++) n += e->hits[i].source == k;
            for (size_t i = 0; i < e->n_hits; i++)
                if (e->hits[i].source == k) e->hits[i].weight = w[k] / (double)n;
        } else if (src->kind == IMP_ELEMENTS_PLANE) {
            struct imp__el_root *r = &e->roots[plane++];
            r->measure = w[k] / r->area;
        } else {
            double area = 0;
            for (size_t i = 0; i < e->n_roots; i++)
                if (is_measured(e, &e->roots[i], src)) area += e->roots[i].area;
            for (size_t i = 0; i < e->n_roots; i++)
                if (is_measured(e, &e->roots[i], src)) e->roots[i].measure += w[k] / area;
        }
    }
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
    for (int i = 0; i < scene->n_emitters; i++)
        if (!(scene->emitters[i]->ops->flags & IMP_EMITTER_AREA))
            IMP_TRY(imp__error(
                e->ctx, IMP_E_UNSUPPORTED,
                "emitter '%s' (%s): finite elements take lights that are surfaces",
                scene->emitters[i]->name, scene->emitters[i]->ops->name));
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
        if (s->geometry != IMP_TRIANGLES)
            IMP_TRY(
                imp__error(e->ctx, IMP_E_UNSUPPORTED,
                           "shape '%s' (%s): finite elements take rectangles, cubes and "
                           "meshes",
                           s->name, s->ops->name));
        e->prim_root[i] =
            imp__arena_array(&e->arena, s->triangles.n_triangles + 1, sizeof(int));
        if (!e->prim_root[i]) IMP_TRY(no_memory(e));
        IMP_TRY(shape_take(e, s, e->prim_root[i]));
    }
    if (e->n_roots == 0)
        IMP_TRY(
            imp__error(e->ctx, IMP_E_SCENE, "the scene has no surfaces with an area"));
    for (size_t i = 0; i < e->n_sources; i++) {
        const struct imp_elements_source *src = &e->sources[i];
        if (src->kind == IMP_ELEMENTS_PLANE) IMP_TRY(plane_add(e, src));
        if (src->kind == IMP_ELEMENTS_SHAPE) IMP_TRY(measure_shape(e, src));
    }
    double *w = imp__arena_array(&e->arena, e->n_sources, sizeof *w);
    if (!w) IMP_TRY(no_memory(e));
    for (size_t i = 0; i < e->n_sources; i++) w[i] = e->sources[i].weight;
    imp__el_weigh(e, w);
out:
    return st;
}

/* ---- Projection, all together -------------------------------------------------- */

static const char *user_of(const imp_elements *e, int material)
{
    for (size_t i = 0; i < e->n_roots; i++)
        if (e->roots[i].material == material && e->roots[i].shape >= 0)
            return e->scene->shapes[e->roots[i].shape]->name;
    return "";
}

#define RESIDUAL_GOOD 0.17 /* chooses order 8 for a Phong lobe of exponent 15 */
#define RESIDUAL_BAD  0.6

enum imp_status imp__el_materials(imp_elements *e)
{
    enum imp_status st = IMP_OK;
    double residual = 0;
    int order = e->opt.order ? e->opt.order : 2;
    for (;; order += 2) {
        const struct imp_arena_mark mark = imp__arena_mark(&e->arena);
        imp__basis_init(&e->basis, order);
        residual = 0;
        for (int i = 0; i < e->n_materials; i++) {
            IMP_TRY(imp__el_project(e->ctx, &e->arena, &e->basis, e->ch, user_of(e, i),
                                    &e->materials[i]));
            residual = fmax(residual, e->materials[i].residual);
        }
        if (e->opt.order || residual <= RESIDUAL_GOOD || order >= EL_ORDER_MAX) break;
        imp__arena_rewind(&e->arena, mark);
    }
    for (int i = 0; i < e->n_materials; i++) {
        const struct imp__el_material *m = &e->materials[i];
        const char *shape = user_of(e, i);
        if (m->residual > RESIDUAL_BAD)
            IMP_TRY(imp__error(
                e->ctx, IMP_E_UNSUPPORTED,
                "shape '%s': its material is too narrow for directional order %d "
                "(relative error %.0f %%)",
                shape, order, 100 * m->residual));
        if (m->residual > RESIDUAL_GOOD)
            imp__warn(e->ctx,
                      "shape '%s': its lobe in directional order %d has a relative error "
                      "of %.0f %%",
                      shape, order, 100 * m->residual);
        if (m->albedo_max > 1 + 1e-4)
            IMP_TRY(imp__error(
                e->ctx, IMP_E_UNSUPPORTED,
                "shape '%s': its material reflects more than arrives (albedo %.4g)",
                shape, m->albedo_max));
    }
out:
    return st;
}
