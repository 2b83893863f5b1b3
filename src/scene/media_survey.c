/* SPDX-License-Identifier: Apache-2.0
 *
 * Looks where cameras and boundaries of media are, when the scene is made. A camera in a
 * medium that it does not name would see it as vacuum; a body in fog that does not name
 * the fog leaves a vacuum behind it, which is what the format defines and Mitsuba does, and
 * seldom what is meant. */
#include "instances.h"
#include "kind/cleared.h"
#include "media_around.h"
#include "priorities.h"
#include "scene_build.h"

#define HITS_MAX 256 /* boundaries that a ray is followed through */
#define PASSES_MAX                                                                       \
    65536 /* other surfaces before one: a ray that meets more stands still */

static const char *name_of(const struct imp_medium *m) { return m ? m->name : "none"; }

/* Those with a priority do not determine the medium around them. */
const struct imp_shape *imp__border_next(const struct imp_scene *scene, imp_v3 *o,
                                         imp_v3 d, bool *outwards)
{
    for (int k = 0; k < PASSES_MAX; k++) {
        struct imp_hit hit;
        struct imp_surface at;
        if (!imp__intersect(scene, o, &d, 0, INFINITY, &hit)) return NULL;
        const struct imp_shape *s = scene->shapes[hit.shape];
        imp__hit_surface(scene, &hit, o, &d, &at);
        *o = imp__offset(at.p, at.ng, d);
        *outwards = imp__dot(at.ng, d) > 0;
        if ((s->interior || s->exterior) && s->priority == 0) return s;
    }
    return NULL;
}

const struct imp_medium *imp__medium_around(const struct imp_scene *scene, imp_v3 p,
                                            imp_v3 d, const struct imp_medium *otherwise)
{
    bool outwards;
    const struct imp_shape *s = imp__border_next(scene, &p, d, &outwards);
    return !s ? otherwise : outwards ? s->interior : s->exterior;
}

/* A ray through this point meets the shape. */
static imp_v3 inner_point(const struct imp_shape *s)
{
    const struct imp_triangles *t = &s->triangles;
    imp_v3 p = {0};
    if (s->geometry != IMP_TRIANGLES || t->n_triangles == 0) return (s->lo + s->hi) * 0.5;
    for (int k = 0; k < 3; k++) {
        const float *v = t->positions + 3 * (size_t)t->indices[k];
        p += imp__v3(v[0], v[1], v[2]) * (1. / 3);
    }
    return p;
}

bool imp__media_vary(const struct imp_scene *scene)
{
    for (int k = 0; k < scene->n_media; k++)
        if (scene->media[k]->majorants) return true;
    return false;
}

struct imp__borders imp__borders_of(const struct imp_scene *scene,
                                    const struct imp_medium *otherwise)
{
    struct imp__borders out = {.scene = scene,
                               .any = otherwise && otherwise->majorants,
                               .varies = imp__media_vary(scene),
                               .outside = otherwise};
    for (int k = 0; k < scene->n_all_shapes; k++) {
        const struct imp_shape *s = scene->shapes[k];
        if (!imp__is_border(scene, s)) continue;
        /* From far away, a ray meets some border from outside. */
        const imp_v3 d = imp__normalize(imp__v3(0.61, 0.53, 0.59));
        const imp_v3 o =
            inner_point(s) - d * (2 * (1 + imp__length(scene->hi - scene->lo)));
        out.any = true;
        out.outside = imp__medium_around(scene, o, d, otherwise);
        break;
    }
    return out;
}

/* In shapes with priorities a camera's medium follows from them. */
static enum imp_status nest_check(const struct imp_scene *scene,
                                  const struct imp_sensor *sensor,
                                  const struct imp_sensor_ray *ray)
{
    struct imp_nest nest;
    if (!imp__nest_at(scene, 0, ray->o, ray->d, &nest))
        return imp__error(scene->ctx, IMP_E_UNSUPPORTED,
                          "sensor '%s' is in more than %d shapes with a priority",
                          sensor->name, IMP_NEST_MAX);
    const struct imp_shape *top = imp__nest_top(scene, &nest);
    if (top && sensor->medium && top->interior == sensor->medium)
        return imp__error(
            scene->ctx, IMP_E_SCENE,
            "sensor '%s' is inside shape '%s', whose priority settles which "
            "medium is there; the sensor names what lies around the shapes "
            "with priorities, or none",
            sensor->name, top->name);
    return IMP_OK;
}

static enum imp_status camera_check(const struct imp_scene *scene,
                                    const struct imp_sensor *sensor)
{
    const double lens[2] = {0.5, 0.5};
    struct imp_sensor_ray ray;
    bool outwards;
    imp__sensor_ray(sensor, 0.5 * sensor->film.width, 0.5 * sensor->film.height, lens,
                    &ray);
    if (scene->priorities) {
        const enum imp_status st = nest_check(scene, sensor, &ray);
        if (st != IMP_OK) return st;
    }
    const struct imp_shape *s = imp__border_next(scene, &ray.o, ray.d, &outwards);
    if (!s) return IMP_OK;
    const struct imp_medium *around = outwards ? s->interior : s->exterior;
    if (around == sensor->medium) return IMP_OK;
    if (outwards)
        return imp__error(scene->ctx, IMP_E_SCENE,
                          "sensor '%s' is inside shape '%s', whose medium is %s, and "
                          "names %s: <ref id=\"...\"/> in the sensor names the medium "
                          "it is in",
                          sensor->name, s->name, name_of(around),
                          name_of(sensor->medium));
    return imp__error(scene->ctx, IMP_E_SCENE,
                      "sensor '%s' is in medium %s, and shape '%s' before it has %s for "
                      "its exterior",
                      sensor->name, name_of(sensor->medium), s->name, name_of(around));
}

/* A line through the middle of the shape; false: what is behind one boundary is not what
 * is before the next. */
static bool line_check(struct imp_scene *scene, const struct imp_shape *shape, int axis)
{
    imp_v3 d = {0.03, 0.02, 0.01, 0}; /* not along the faces of boxes */
    const imp_v3 centre = (shape->lo + shape->hi) * 0.5;
    const struct imp_shape *s;
    const struct imp_medium *m = NULL;
    bool outwards, known = false;
    d[axis] = 1;
    d = imp__normalize(d);
    imp_v3 o = centre - d * (2 * (1 + imp__length(scene->hi - scene->lo)));
    for (int k = 0; k < HITS_MAX && (s = imp__border_next(scene, &o, d, &outwards));
         k++) {
        const struct imp_medium *before = outwards ? s->interior : s->exterior;
        if (known && before != m) {
            imp__warn(scene->ctx,
                      "shape '%s': before it is medium %s, and its %s is %s. A ray takes "
                      "what the shape names, as in Mitsuba; bodies in a medium name it "
                      "as their exterior",
                      s->name, name_of(m), outwards ? "interior" : "exterior",
                      name_of(before));
            return false;
        }
        m = outwards ? s->exterior : s->interior;
        known = true;
    }
    return true;
}

enum imp_status imp__media_survey(struct imp_scene *scene)
{
    enum imp_status st = IMP_OK;
    if (scene->n_media == 0 && !scene->priorities) return IMP_OK;
    for (int i = 0; i < scene->n_sensors; i++)
        IMP_TRY(camera_check(scene, scene->sensors[i]));
    for (int i = 0; i < scene->n_shapes && !scene->media_open; i++) {
        const struct imp_shape *s = scene->shapes[i];
        const bool tells = (s->interior || s->exterior) && s->priority == 0;
        for (int a = 0; a < 3 && tells && !scene->media_open; a++)
            scene->media_open = !line_check(scene, s, a);
    }
out:
    return st;
}
