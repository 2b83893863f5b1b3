/* SPDX-License-Identifier: Apache-2.0
 *
 * Places and motions that the boundary cannot differentiate (boundary.h), refused by name. */
#include "boundary_allowed.h"
#include "base/arguments.h"
#include "boundary_one_sided.h"
#include "move/strand.h"
#include "moved_mirror.h"
#include "moved_sky.h"

extern const struct imp_bsdf_ops imp__twosided;
extern const struct imp_sensor_ops imp__distant;

/* A light at a point, or parallel light, and a mesh with vertex normals that move against each
 * other: a facet that turns away from it becomes dark all at once. */
static enum imp_status facets_allowed(const struct imp__boundary *b)
{
    const struct imp_scene *scene = b->tracer->scene;
    for (int k = 0; k < scene->n_emitters; k++) {
        const struct imp_emitter *e = scene->emitters[k];
        if (!(e->ops->flags & IMP_EMITTER_DELTA)) continue;
        for (size_t j = 0; j < b->edges->n_bodies; j++) {
            const struct imp__body *body = &b->edges->body[j];
            if (imp__moves_smooth(scene, body->shape) &&
                (imp__moves_place(b->moves,
                                  imp__carrier(scene, body->shape, body->place)) ||
                 imp__moves_shape(b->moves, IMP_MOVE_EMITTER(k), NULL)))
                return imp__error(
                    scene->ctx, IMP_E_UNSUPPORTED,
                    "derivatives by what moves: light '%s' (%s) and shape '%s', which "
                    "has "
                    "vertex normals, move against each other: facets that turn away from "
                    "a light without size become dark all at once (face_normals makes "
                    "the shape flat)",
                    e->name ? e->name : "", e->ops->name,
                    scene->shapes[body->shape]->name);
        }
    }
    return IMP_OK;
}

/* Does a ray from the camera meet the back of a shape that shows nothing there? */
static bool back_met(const struct imp__boundary *b, imp_v3 w, struct imp_hit *hit)
{
    const struct imp_scene *scene = b->tracer->scene;
    struct imp_surface at;
    if (!imp__intersect(scene, &b->camera, &w, 0, INFINITY, hit)) return false;
    imp__hit_surface(scene, hit, &b->camera, &w, &at);
    const int met = imp__placed_shape(scene, hit->shape, hit->place);
    const struct imp_bsdf *bsdf = imp__shape_bsdf(scene, scene->shapes[met]);
    return imp__dot(at.ng, w) > 0 && bsdf->ops != &imp__twosided &&
           !(bsdf->flags & IMP_BSDF_TRANSMIT) && !bsdf->straight;
}

#define PROBES 64

/* A camera inside of a shape, of which it sees the back in every direction: the picture is black, and
 * its derivative is none that anybody asks for. */
static enum imp_status camera_allowed(const struct imp__boundary *b)
{
    const struct imp_scene *scene = b->tracer->scene;
    struct imp_hit first = {.shape = -1};
    if (b->tracer->sensor->shape || b->parallel || b->rays) return IMP_OK;
    for (uint32_t k = 0; k < PROBES; k++) {
        const struct imp_key key = imp__key(5, 3, k);
        const double u[2] = {imp__u01(key, 0), imp__u01(key, 1)};
        struct imp_hit met;
        if (!back_met(b, imp__uniform_sphere(u), &met)) return IMP_OK;
        if (k == 0) first = met;
        else if (met.shape != first.shape || met.place != first.place) return IMP_OK;
    }
    const int shape = first.shape;
    if (!imp__moves_place(b->moves, imp__carrier(scene, shape, first.place)) &&
        !imp__moves_shape(b->moves, IMP_MOVE_CAMERA, NULL))
        return IMP_OK;
    return imp__error(
        scene->ctx, IMP_E_UNSUPPORTED,
        "derivatives by what moves: sensor '%s' is inside of shape '%s', of "
        "which it sees nothing but the back",
        b->tracer->sensor->name, scene->shapes[shape]->name);
}

/* What has edges past which light of a sky jumps that stay, while the sky turns: none is drawn along its
 * own directions. */
static const char *turn_why(const struct imp__boundary *b)
{
    const struct imp_sensor *sensor = b->tracer->sensor;
    if (b->passes) return "a material of the scene lets light straight through";
    if (b->mirrors) return "the scene has mirrors";
    if (imp__meter_is_points(sensor)) return "the sensor is a meter at points";
    if (b->rays) return "the sensor measures along single rays";
    for (size_t j = 0; j < b->edges->n_bodies; j++)
        if (imp__moves_smooth(b->tracer->scene, b->edges->body[j].shape))
            return "a shape has vertex normals (face_normals makes it flat)";
    return NULL;
}

static enum imp_status turns_allowed(const struct imp__boundary *b)
{
    const struct imp_scene *scene = b->tracer->scene;
    for (int k = 0; k < scene->n_emitters && b->moves->skies; k++) {
        const struct imp_emitter *e = scene->emitters[k];
        const char *why = NULL;
        struct imp__sky_sun sun;
        const bool moves = e->ops->flags & IMP_EMITTER_ENVIRONMENT &&
                           imp__moves_shape(b->moves, IMP_MOVE_EMITTER(k), NULL),
                   parts = moves && imp__sky_in_parts(b->moves, k);
        if (parts) imp__sky_sun_read(e, &sun);
        if (moves && !(parts && sun.radius == 0)) why = turn_why(b);
        if (why)
            return imp__error(scene->ctx, IMP_E_UNSUPPORTED,
                              "derivatives by what moves: light '%s' (%s) turns, and %s",
                              e->name ? e->name : "", e->ops->name, why);
        if (parts && !imp__sky_sun_is_clear(e))
            return imp__error(
                scene->ctx, IMP_E_UNSUPPORTED,
                "derivatives by what moves: the sun of light '%s' (%s) touches the "
                "horizon, which cuts it",
                e->name ? e->name : "", e->ops->name);
    }
    return IMP_OK;
}

/* Is it no glass, and of planes? */
static bool is_flat(const struct imp_scene *scene, const struct imp_hit *hit)
{
    struct imp_round round;
    struct imp__tube tube;
    return !imp__is_glass(imp__hit_bsdf(scene, hit)) &&
           !imp__moves_sphere(scene, hit->shape, hit->place, &round) &&
           !imp__moves_cylinder(scene, hit->shape, hit->place, &tube);
}

/* Where a flat mirror turns, circles at which a sky jumps move in it as any vertex sees it, and none is drawn
 * there but what the camera sees; of parallel rays not that either. */
static enum imp_status skies_allowed(const struct imp__boundary *b)
{
    const struct imp_scene *scene = b->tracer->scene;
    for (int k = 0; k < scene->n_environments && b->mirrors; k++) {
        const struct imp_emitter *e = scene->emitters[scene->environments[k]];
        struct imp_sky_circle circle[IMP_SKY_CIRCLES];
        bool turns = b->parallel && imp__moves_shape(b->moves, IMP_MOVE_CAMERA, NULL);
        for (size_t j = 0; j < b->edges->n_bodies; j++) {
            const struct imp__body *x = &b->edges->body[j];
            const struct imp_hit hit = {.shape = x->shape, .place = x->place};
            turns |=
                imp__mirror_lobes(imp__hit_bsdf(scene, &hit)) && is_flat(scene, &hit) &&
                imp__moves_shape(b->moves, imp__carrier(scene, x->shape, x->place), NULL);
        }
        if (turns && e->ops->jumps(e, circle) > 0)
            return imp__error(scene->ctx, IMP_E_UNSUPPORTED,
                              "derivatives by what moves: light '%s' (%s) jumps at its "
                              "horizon or sun, which is seen in mirrors",
                              e->name ? e->name : "", e->ops->name);
    }
    return IMP_OK;
}

static enum imp_status seam_bends(const struct imp__boundary *b,
                                  const struct imp__edge_face *f)
{
    const struct imp_scene *scene = b->tracer->scene;
    const struct imp_hit hit = {.shape = f->shape, .place = f->place};
    const struct imp_bsdf *own = imp__hit_bsdf(scene, &hit);
    const int placed = imp__placed_shape(scene, f->shape, f->place);
    if (!imp__mirror_lobes(own) ||
        (scene->shapes[placed]->geometry == IMP_TRIANGLES && !imp__is_glass(own)))
        return IMP_OK;
    return imp__error(scene->ctx, IMP_E_UNSUPPORTED,
                      "derivatives by what moves: shape '%s' passes through another one, "
                      "and is a curved mirror, or bends light",
                      scene->shapes[f->shape]->name);
}

/* Rays turn where a ball is met elsewhere, and what is seen over it has no draws of all kinds. */
static enum imp_status bends_allowed(const struct imp__boundary *b)
{
    const struct imp_scene *scene = b->tracer->scene;
    const char *where = "in a scene with a curved mirror, or with glass that bends light";
    if (!b->bends) return IMP_OK;
    for (int k = 0; k < scene->n_environments; k++) {
        const struct imp_emitter *e = scene->emitters[scene->environments[k]];
        struct imp_sky_circle circle[IMP_SKY_CIRCLES];
        if (b->tracer->sensor->shape && e->ops->jumps(e, circle) > 0)
            return imp__error(
                scene->ctx, IMP_E_UNSUPPORTED,
                "derivatives by what moves: light '%s' (%s) jumps at its horizon or sun, "
                "and the sensor is a surface, %s",
                e->name ? e->name : "", e->ops->name, where);
    }
    for (size_t k = 0; k < b->edges->n_bodies; k++) {
        const struct imp__body *body = &b->edges->body[k];
        const char *why = imp__moves_smooth(scene, body->shape)
                              ? "has vertex normals (face_normals makes it flat)"
                          : imp__is_strand(scene, body->shape, body->place) ? "is a curve"
                                                                            : NULL;
        if (why)
            return imp__error(scene->ctx, IMP_E_UNSUPPORTED,
                              "derivatives by what moves: shape '%s' %s, %s",
                              scene->shapes[body->shape]->name, why, where);
    }
    for (size_t k = 0; k < 2 * b->edges->n_arcs; k++)
        IMP_CHECKED(seam_bends(b, &b->edges->arc[k / 2].side[k % 2]));
    for (size_t k = 0; k < b->edges->n; k++) {
        const struct imp__edge *e = &b->edges->edge[k];
        for (int j = 0; j < e->n_faces && e->seam; j++)
            IMP_CHECKED(seam_bends(b, &b->edges->face[e->first + (size_t)j]));
    }
    return IMP_OK;
}

#define AT_BORDER 1e-6 /* of the scene's size */

/* A distant sensor is a mean over the ball around the scene's box: what moves must not move that. */
static enum imp_status ball_allowed(const struct imp__boundary *b)
{
    const struct imp_scene *scene = b->tracer->scene;
    const struct imp_sensor *sensor = b->tracer->sensor;
    const double near = AT_BORDER * b->size;
    const bool whole = sensor->ops == &imp__distant && !b->rays;
    for (const struct imp_pose *p = whole ? scene->poses : NULL; p; p = p->next) {
        imp_v3 lo, hi;
        bool inside = true;
        const int shape = p->instance >= 0 ? IMP_MOVE_INSTANCE(p->instance) : p->shape;
        if (!imp__pose_box(p, &lo, &hi) ||
            (p->group < 0 && !imp__moves_place(b->moves, shape)))
            continue;
        for (int i = 0; i < 3; i++)
            inside &= lo[i] > scene->lo[i] + near && hi[i] < scene->hi[i] - near;
        if (!inside)
            return imp__error(
                scene->ctx, IMP_E_UNSUPPORTED,
                "derivatives by what moves: %s is at the border of the scene, and "
                "sensor '%s' (%s) is a mean over the ball around that, which would move "
                "(something larger around it may stay)",
                scene->params[p->param].info.name, sensor->name, sensor->ops->name);
    }
    return IMP_OK;
}

enum imp_status imp__boundary_allowed(const struct imp__boundary *b)
{
    enum imp_status st = imp__timed_allowed(b);
    if (st == IMP_OK) st = imp__edges_allowed(b);
    if (st == IMP_OK) st = imp__one_sided_allowed(b);
    if (st == IMP_OK) st = imp__borders_allowed(b);
    if (st == IMP_OK) st = turns_allowed(b);
    if (st == IMP_OK) st = skies_allowed(b);
    if (st == IMP_OK) st = bends_allowed(b);
    if (st == IMP_OK) st = ball_allowed(b);
    if (st == IMP_OK) st = imp__rays_allowed(b);
    if (st == IMP_OK) st = facets_allowed(b);
    if (st == IMP_OK) st = imp__cuts_allowed(b);
    if (st == IMP_OK) st = camera_allowed(b);
    return st;
}
