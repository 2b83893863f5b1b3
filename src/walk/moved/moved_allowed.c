/* SPDX-License-Identifier: Apache-2.0
 *
 * What has a derivative by what moves that is whole, and what is refused by name (moved.h). */
#include "base/arguments.h"
#include "base/context.h"
#include "kind/emitter/from_point.h"
#include "kind/emitter/ies.h"
#include "math/warp.h"
#include "moved.h"
#include "moved_kernel.h"
#include "moved_mirror.h"
#include "scene/instances.h"
#include "scene/pose.h"
#include "walk/media/media_along.h"
#include "walk/media/tracking.h"
#include "walk/path/first_segment.h"

extern const struct imp_bsdf_ops imp__mask, imp__twosided, imp__conductor, imp__plastic;
extern const struct imp_emitter_ops imp__area, imp__point_light, imp__spot_light,
    imp__directional, imp__projector;

static enum imp_status refuse(const struct imp_tracer *t, const char *what,
                              const char *name, const char *kind, const char *why)
{
    return imp__error(t->scene->ctx, IMP_E_UNSUPPORTED,
                      "derivatives by what moves: %s '%s' (%s) %s", what,
                      name ? name : "", kind, why);
}

static bool is_textured(const struct imp_input *const *input, int n)
{
    for (int k = 0; k < n; k++)
        if (input[k]->texture) return true;
    return false;
}

/* Reflects it all light next to the limb of a ball, whatever it scatters or lets through elsewhere? */
static bool is_all_at_limb(const struct imp_bsdf *b)
{
    if (b->ops == &imp__twosided) {
        for (int k = 0; k < b->n_child; k++)
            if (!is_all_at_limb(b->child[k])) return false;
        return true;
    }
    return b->ops == &imp__conductor || b->ops == &imp__plastic || imp__is_glass(b);
}

/* Why a shape that is a mirror, in part, or bends light has no draws for what is seen in it; NULL: it has. */
static const char *mirror_without_d(const struct imp_tracer *t, const struct imp_shape *s)
{
    const struct imp_bsdf *b = imp__shape_bsdf(t->scene, s);
    struct imp_round round;
    struct imp__tube tube;
    const bool curved = imp__moves_sphere(t->scene, s->index, 0, &round) ||
                        imp__moves_cylinder(t->scene, s->index, 0, &tube);
    if (s->smooth)
        return "is a mirror on a mesh with vertex normals (face_normals makes it flat)";
    if (s->geometry != IMP_TRIANGLES && !(s->ops->flags & IMP_SHAPE_FLAT) && !curved)
        return "is a mirror, or bends light, on a curved shape that is no sphere or "
               "circular cylinder: edges that are seen in it have no draws";
    if (curved && !is_all_at_limb(b))
        return "reflects in single directions, on a sphere or cylinder, and is none of "
               "conductor, plastic and dielectric";
    if (s->emitter >= 0) return "is a mirror, and its shape is a light";
    if (t->scene->n_media > 0 && imp__segment_first(t)->through && t->sensor->medium)
        return "is a mirror in a medium";
    return NULL;
}

static enum imp_status materials_allowed(const struct imp_tracer *t)
{
    for (int k = 0; k < t->scene->n_all_shapes; k++) {
        const struct imp_shape *s = t->scene->shapes[k];
        const struct imp_bsdf *b = imp__shape_bsdf(t->scene, s);
        const char *why =
            imp__kernel_without_d(b, s->geometry != IMP_TRIANGLES || s->smooth);
        if (!why) why = imp__textures_without_d(b, s);
        if (!why && imp__mirror_lobes(b)) why = mirror_without_d(t, s);
        if (!why && imp__passes_by_angle(b) && imp__segment_first(t)->through)
            why = "lets light samples of volpath through, by parts that change with the "
                  "angle (those of path stop there)";
        if (!why && b->shaped) why = "has a spectrum for a number";
        if (!why && b->straight && s->emitter >= 0)
            why = "lets light pass, and its shape is a light";
        if (!why && b->ops == &imp__mask && b->input[0]->texture &&
            imp__segment_first(t)->through)
            why = "has an opacity with a texture, which light samples of volpath pass "
                  "(those of path do not)";
        if (why) return refuse(t, "material", b->name, b->ops->name, why);
    }
    return IMP_OK;
}

/* Where light by this table jumps, in words that follow its name; NULL: nowhere. A flat shape hides what
 * is sent behind it. */
static const char *table_jump(const struct imp__ies *x)
{
    enum { AROUND = 64 };
    const char *jump = imp__ies_jump(x->data);
    if (jump || x->n_facets != 1) return jump;
    const struct imp_frame f = imp__frame_from_normal(x->facets[0].n);
    double most = 0;
    for (int k = 0; k < AROUND; k++) {
        const double a = IMP_2PI * (k + 0.5) / AROUND;
        most = imp_max(most, imp__ies_intensity(x, f.s * cos(a) + f.t * sin(a)));
    }
    return most > 1e-6 * imp__ies_flux(x) ? "has light along the plane of its shape"
                                          : NULL;
}

/* A picture turns with a spot or projector; other textures of lights stay refused. */
static const char *picture_why(const struct imp_emitter *e)
{
    if (e->shaped) return "has a texture or spectrum of many wavelengths";
    if (!is_textured(e->input, e->n_in)) return NULL;
    if (!imp__light_frame_of(e)) return "has a texture";
    for (int k = 0; k < e->n_in; k++)
        if (imp__input_jumps(e->input[k])) return "has a texture whose values jump";
    return NULL;
}

static enum imp_status lights_allowed(const struct imp_tracer *t)
{
    for (int k = 0; k < t->scene->n_emitters; k++) {
        const struct imp_emitter *e = t->scene->emitters[k];
        const bool sky = e->ops->flags & IMP_EMITTER_ENVIRONMENT;
        if (sky ? !e->ops->jumps
                : e->ops != &imp__area && e->ops != &imp__point_light &&
                      e->ops != &imp__spot_light && e->ops != &imp__directional &&
                      e->ops != &imp__ies_light && e->ops != &imp__ies_area &&
                      e->ops != &imp__projector)
            return refuse(t, "light", e->name, e->ops->name,
                          sky ? "does not say where its radiance jumps"
                              : "is none of area, point, spot, projector, directional, "
                                "ies, and skies");
        if (e->ops == &imp__ies_light || e->ops == &imp__ies_area) {
            const char *jump = table_jump(e->self);
            if (jump) return refuse(t, "the table of light", e->name, e->ops->name, jump);
        }
        const char *picture = picture_why(e);
        if (!sky && picture) return refuse(t, "light", e->name, e->ops->name, picture);
        if (e->shape && e->shape->geometry != IMP_TRIANGLES &&
            !imp__moves_curved(t->scene, e->shape->index, 0))
            return refuse(t, "light", e->name, e->ops->name,
                          "is on a shape that is not made of triangles, and no sphere, "
                          "disk or circular cylinder");
        if (e->shape && e->shape->smooth)
            return refuse(t, "light", e->name, e->ops->name,
                          "is on a mesh with vertex normals, whose light ends where "
                          "these turn away (face_normals makes it flat)");
        if (e->course)
            return refuse(t, "light", e->name, e->ops->name, "changes with time");
    }
    return IMP_OK;
}

/* Why walks through this medium have no such derivative; NULL: they have. */
static const char *medium_without_d(const struct imp_tracer *t,
                                    const struct imp_medium *m)
{
    const char *why = imp__along_without(t->scene, m);
    return !why && m->scatterer->shaped ? "has a spectrum for a number" : why;
}

#define EVERYWHERE 1e30
bool imp__medium_scatters(const struct imp_medium *m)
{
    imp_spec in[IMP_INPUTS_MAX];
    struct imp_coefficients c;
    const struct imp_texcoord nowhere = {.prim = 0};
    imp__inputs_eval(m->input, m->n_own, &nowhere, in);
    /* The most of what varies: scattering does not fall where a number of it rises. */
    const imp_v3 hi = imp__v3(EVERYWHERE, EVERYWHERE, EVERYWHERE), lo = -hi;
    for (int j = 0; j < m->n_own; j++)
        if (m->input[j]->texture) imp__input_most(m->input[j], &lo, &hi, &in[j]);
    m->ops->eval(m, in, &c);
    return !imp__is_zero(c.scattering);
}

/* Is the medium the same on both sides of a shape, as far as light goes there? */
static bool is_filled(const struct imp_tracer *t, const struct imp_shape *s,
                      const struct imp_medium *m)
{
    const struct imp_bsdf *b = imp__shape_bsdf(t->scene, s);
    if (!s->interior && !s->exterior) return true;
    return s->exterior == m && (s->interior == m || !(b->flags & IMP_BSDF_TRANSMIT));
}

/* Why a shape cannot stand in a scene in which media end; NULL: it can. */
static const char *border_why(const struct imp_tracer *t, const struct imp_shape *s)
{
    const struct imp_scene *scene = t->scene;
    const struct imp_bsdf *b = imp__shape_bsdf(scene, s);
    const bool names = s->interior || s->exterior;
    if (imp__mirror_lobes(b)) return "is a mirror, in a scene where media end";
    if (b->straight && !(b->flags & IMP_BSDF_NULL))
        return "lets light go straight on, in a scene where media end";
    if (names && s->index >= imp__shapes_outside(scene))
        return "bounds a medium, in a shape group";
    if (!imp__is_border(scene, s))
        return names && s->interior != s->exterior && b->flags & IMP_BSDF_TRANSMIT
                   ? "bounds a medium, and is not of type null"
                   : NULL;
    if (s->emitter >= 0) return "bounds a medium, and is a light";
    if (s->smooth) return "bounds a medium, and has vertex normals (face_normals)";
    if (!scene->closed[s->index])
        return "bounds a medium, and is no sphere or mesh that is closed, with normals "
               "that point outwards";
    return NULL;
}

static enum imp_status borders_allowed(const struct imp_tracer *t)
{
    const struct imp_scene *scene = t->scene;
    const struct imp_sensor *sensor = t->sensor;
    imp_v3 point;
    for (int k = 0; k < scene->n_all_shapes; k++) {
        const struct imp_shape *s = scene->shapes[k];
        const char *why = border_why(t, s);
        if (why) return refuse(t, "shape", s->name, s->ops->name, why);
        if (scene->media_open && (s->interior || s->exterior))
            return refuse(t, "shape", s->name, s->ops->name,
                          "bounds a medium, and others lie in one that they do not name");
    }
    if (sensor->shape || imp__sees_rays(sensor, &point))
        return refuse(t, "sensor", sensor->name, sensor->ops->name,
                      "is a surface, or measures along single rays, in a scene where "
                      "media end");
    return IMP_OK;
}

/* What one medium, and lights in a scene where it is, must not be. */
static enum imp_status medium_allowed(const struct imp_tracer *t,
                                      const struct imp_medium *m)
{
    const struct imp_scene *scene = t->scene;
    const char *why = medium_without_d(t, m);
    if (why) return refuse(t, "medium", m->name, m->ops->name, why);
    for (int k = 0; k < scene->n_emitters && imp__medium_scatters(m); k++) {
        const struct imp_emitter *e = scene->emitters[k];
        if (e->ops->flags & IMP_EMITTER_DELTA && !(e->ops->flags & IMP_EMITTER_FAR))
            return refuse(t, "light", e->name, e->ops->name,
                          "has no size, in a scene with a medium that scatters: what "
                          "points next to it receive has no bounded derivative");
    }
    return IMP_OK;
}

/* A medium that fills the scene, of one extinction, or media of one each that end within it. */
static enum imp_status media_allowed(const struct imp_tracer *t)
{
    const struct imp_scene *scene = t->scene;
    const struct imp_medium *m = t->sensor->medium;
    imp_spec extinction;
    if (scene->n_media == 0 || !imp__segment_first(t)->through) return IMP_OK;
    if (imp__borders_of(scene, m).any) {
        IMP_CHECKED(borders_allowed(t));
        if (m) IMP_CHECKED(medium_allowed(t, m));
        for (int k = 0; k < scene->n_all_shapes; k++) {
            const struct imp_shape *s = scene->shapes[k];
            if (s->interior) IMP_CHECKED(medium_allowed(t, s->interior));
            if (s->exterior) IMP_CHECKED(medium_allowed(t, s->exterior));
        }
        return IMP_OK;
    }
    for (int k = 0; k < scene->n_all_shapes; k++)
        if (!is_filled(t, scene->shapes[k], m))
            return refuse(t, "shape", scene->shapes[k]->name, scene->shapes[k]->ops->name,
                          "bounds a medium, or the sensor is in another one (a medium "
                          "fills the scene, and is that of the sensor, or ends at shapes "
                          "of type null)");
    if (!imp__fog(t, NULL, &extinction)) return IMP_OK;
    if (t->sensor->shape)
        return refuse(t, "sensor", t->sensor->name, t->sensor->ops->name,
                      "is a surface in a medium");
    return medium_allowed(t, m);
}

static enum imp_status walks_allowed(const struct imp_tracer *t)
{
    const struct imp_scene *scene = t->scene;
    const struct imp_walk_integrator *i = t->integrator;
    const bool many = scene->world && scene->world->n_places >= IMP_PLACE_MOST;
    const char *why = many                  ? "there are too many instances"
                      : scene->n_bodies > 0 ? "there are media of graded index"
                      : scene->priorities   ? "shapes have priorities"
                      : i->from_lights      ? "walks begin at the lights"
                      : i->ends_by != IMP_ENDS_BY_ROULETTE ? "walks end by absorption"
                      : i->hide_emitters                   ? "emitters are hidden"
                      : i->mixes || i->split > 1 || t->split > 1 || t->guide
                          ? "directions have densities beside the material's"
                      : t->kept ? "walks are kept"
                                : NULL;
    if (!why) return IMP_OK;
    return imp__error(scene->ctx, IMP_E_UNSUPPORTED, "derivatives by what moves: %s",
                      why);
}

static enum imp_status meter_allowed(const struct imp_tracer *t)
{
    const struct imp_sensor *s = t->sensor;
    const struct imp_shape *on = s->shape;
    const bool flat = on->ops->flags & IMP_SHAPE_FLAT || s->receiver;
    if (!s->ops->connect || !flat ||
        (on->geometry != IMP_TRIANGLES && !imp__moves_curved(t->scene, on->index, 0)))
        return refuse(t, "sensor", s->name, s->ops->name, "is on no flat shape");
    if (on->smooth)
        return refuse(t, "sensor", s->name, s->ops->name,
                      "is on a mesh with vertex normals (face_normals makes it flat)");
    return IMP_OK;
}

/* Has the scene masks, or others, which light samples pass? */
static bool samples_pass(const struct imp_tracer *t)
{
    bool any = false;
    for (int k = 0; k < t->scene->n_all_shapes; k++)
        any |= imp__shape_bsdf(t->scene, t->scene->shapes[k])->straight != 0;
    return any && imp__segment_first(t)->through;
}

static enum imp_status sensor_allowed(const struct imp_tracer *t)
{
    const struct imp_sensor *s = t->sensor;
    imp_v3 centre;
    if (s->shape && samples_pass(t))
        return refuse(t, "sensor", s->name, s->ops->name,
                      "is a surface, and its light samples pass masks (those of path do "
                      "not)");
    if (s->shape) return meter_allowed(t);
    if (!imp__lens_middle(s, &centre))
        return refuse(t, "sensor", s->name, s->ops->name,
                      "is none of perspective, thinlens, orthographic, distant and "
                      "radiancemeter");
    return IMP_OK;
}

bool imp__fog(const struct imp_tracer *tracer, const struct imp_carried *carried,
              imp_spec *extinction)
{
    const struct imp_medium *m = tracer->sensor->medium;
    imp_spec in[IMP_INPUTS_MAX];
    if (imp_likely(!m) || !imp__segment_first(tracer)->through) return false;
    *extinction = imp__extinction_at(m, (imp_v3){0}, carried, in);
    return true;
}

enum imp_status imp__moved_allowed(const struct imp_tracer *tracer)
{
    enum imp_status st = walks_allowed(tracer);
    if (st == IMP_OK) st = media_allowed(tracer);
    if (st == IMP_OK) st = sensor_allowed(tracer);
    if (st == IMP_OK) st = materials_allowed(tracer);
    if (st == IMP_OK) st = lights_allowed(tracer);
    return st;
}
