/* SPDX-License-Identifier: Apache-2.0
 *
 * Graded media: which shapes they fill, their coefficients as parameters, and what of
 * them can be differentiated. */
#include "kind/shape/shape.h"
#include "scene_build.h"

enum imp_status imp__build_body(struct imp_scene *scene, struct imp_node *node,
                                const char *parent, const struct imp_body **out)
{
    enum imp_status st = IMP_OK;
    struct imp_body *m = node->body;
    if (!m)
        return imp__node_error(scene->ctx, node, IMP_E_UNSUPPORTED,
                               "this version has no such medium; it has graded");
    if (m->index >= 0) {
        *out = m;
        return IMP_OK;
    }
    m->name = imp__build_object_name(scene, node, parent, "interior");
    if (!m->name) return imp__build_no_memory(scene);
    for (int i = 0; i < m->n_numbers; i++) {
        struct imp_body_numbers *n = &m->numbers[i];
        struct imp_param p = {.store = IMP_STORE_DOUBLES, .doubles = n->number};
        p.info.name = imp__build_name(scene, m->name, n->key);
        if (!p.info.name) return imp__build_no_memory(scene);
        p.info.unit = "1";
        p.info.n_dims = n->n_dims;
        for (int d = 0; d < n->n_dims; d++) p.info.dims[d] = n->dims[d];
        p.info.flags = IMP_PARAM_DISCONTINUOUS;
        if (n->n_dims == 3) p.info.layers = n->dims[0];
        p.info.lo = n->lo;
        p.info.hi = n->hi;
        IMP_TRY(imp__theta_add(scene, &p, &n->param));
    }
    IMP_TRY(imp__props_finish(scene->ctx, node));
    m->lo = imp__v3(INFINITY, INFINITY, INFINITY);
    m->hi = -m->lo;
    for (int i = 0; i < scene->n_bodies; i++)
        if (scene->bodies[i] == m) m->index = i;
    *out = m;
out:
    return st;
}

/* A boundary is a null surface, or a dielectric whose index inside is the field's. */
static enum imp_status boundary_check(const struct imp_scene *scene,
                                      const struct imp_shape *s)
{
    const struct imp_bsdf *b = imp__shape_bsdf(scene, s);
    const bool dielectric = b->index_input >= 0 && !(b->flags & IMP_BSDF_SMOOTH);
    if (!dielectric && !(b->flags & IMP_BSDF_NULL))
        return imp__error(scene->ctx, IMP_E_UNSUPPORTED,
                          "shape '%s': a graded medium ends at a bsdf of type dielectric "
                          "or null, not %s",
                          s->name, b->ops->name);
    if (s->emitter >= 0)
        return imp__error(scene->ctx, IMP_E_UNSUPPORTED,
                          "shape '%s': the boundary of a graded medium cannot emit",
                          s->name);
    return IMP_OK;
}

/* Do their boxes meet? */
static bool is_near(const struct imp_shape *s, const struct imp_body *m)
{
    bool near = true;
    for (int k = 0; k < 3; k++) near &= s->lo[k] <= m->hi[k] && s->hi[k] >= m->lo[k];
    return near;
}

/* Bent rays end on triangles, flat shapes, spheres and circular cylinders: of others the
 * level whose zero they end on (bend/inside.c) is not known. */
static enum imp_status bent_check(const struct imp_scene *scene,
                                  const struct imp_shape *s)
{
    struct imp_round round;
    const bool oval = s->ops->round && !imp__shape_round(s, &round);
    bool near = false;
    if (!oval && s->geometry != IMP_CURVES) return IMP_OK;
    for (int i = 0; i < scene->n_bodies; i++)
        near |= scene->bodies[i]->index >= 0 && is_near(s, scene->bodies[i]);
    return near ? imp__error(
                      scene->ctx, IMP_E_UNSUPPORTED,
                      "shape '%s': %s in the box around a graded medium, whose rays "
                      "end on triangles, flat shapes, spheres and circular "
                      "cylinders",
                      s->name, oval ? "an oval cylinder" : "a curve")
                : IMP_OK;
}

/* The only shape of a medium, if it is a sphere and no other shape's box meets its own: a
 * ray inside meets nothing before it is outside. */
static const struct imp_shape *ball_of(const struct imp_scene *scene,
                                       const struct imp_body *m)
{
    const struct imp_shape *ball = NULL;
    struct imp_round round;
    for (int i = 0; i < scene->n_shapes; i++) {
        const struct imp_shape *s = scene->shapes[i];
        if (s->body == m) {
            if (ball) return NULL;
            ball = s;
            continue;
        }
        if (is_near(s, m)) return NULL;
    }
    if (!ball || !imp__shape_round(ball, &round)) return NULL;
    return imp__dot(round.axis, round.axis) == 0 ? ball : NULL;
}

/* Reason why the derivative with respect to the field would be incomplete, as far as the
 * scene alone decides it; NULL: none. src/walk/path/graded_survey.c checks what rays meet. */
static const char *fixed_because(const struct imp_scene *scene, const struct imp_body *m)
{
    if (scene->integrator && scene->integrator->ops->flags & IMP_INTEGRATOR_NO_FIELDS)
        return "the scene's integrator has no derivative of the field";
    if (scene->environment >= 0 &&
        !(scene->emitters[scene->environment]->ops->flags & IMP_EMITTER_UNIFORM))
        return "an environment other than constant lies around it";
    if (scene->n_environments > 1) return "several environments lie around it";
    for (int i = 0; i < scene->n_shapes; i++) {
        const struct imp_shape *s = scene->shapes[i];
        if (s->body != m) continue;
        const struct imp_bsdf *b = imp__shape_bsdf(scene, s);
        if (s->smooth)
            return "its boundary has vertex normals, whose turning is not differentiated";
        for (int j = 0; j < b->n_in; j++)
            if (b->input[j]->texture)
                return "its boundary is textured, and rays move over it";
    }
    return NULL;
}

enum imp_status imp__bodies_check(struct imp_scene *scene)
{
    for (int i = 0; i < scene->n_shapes; i++) {
        struct imp_shape *s = scene->shapes[i];
        if (!s->body) continue;
        const enum imp_status st = boundary_check(scene, s);
        if (st != IMP_OK) return st;
        struct imp_body *m = scene->bodies[s->body->index];
        for (int k = 0; k < 3; k++) {
            m->lo[k] = imp_min(s->lo[k], m->lo[k]);
            m->hi[k] = imp_max(s->hi[k], m->hi[k]);
        }
    }
    for (int i = 0; i < scene->n_shapes; i++) {
        const enum imp_status st = bent_check(scene, scene->shapes[i]);
        if (st != IMP_OK) return st;
    }
    for (int i = 0; i < scene->n_bodies; i++) {
        struct imp_body *m = scene->bodies[i];
        if (m->index < 0) continue;
        if (scene->world)
            return imp__node_error(scene->ctx, m->node, IMP_E_UNSUPPORTED,
                                   "a scene with instances has no graded index: where "
                                   "its rays end would have to be known to their "
                                   "derivatives");
        m->ball = ball_of(scene, m);
        const char *why = fixed_because(scene, m);
        for (int k = 0; k < m->n_numbers; k++) {
            struct imp_param_info *info = &scene->params[m->numbers[k].param].info;
            info->why = why ? why : m->numbers[k].why;
            if (!info->why) info->flags |= IMP_PARAM_DIFFERENTIABLE;
        }
    }
    return IMP_OK;
}
