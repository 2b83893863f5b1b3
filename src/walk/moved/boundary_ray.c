/* SPDX-License-Identifier: Apache-2.0
 *
 * Edges for a sensor that reads along single rays (boundary.h): a radiancemeter, or a distant one with
 * a target. An edge crosses a ray almost never, so the picture has no edges. What jumps is what the point
 * x receives that the ray meets: as of the point of a meter (boundary_meter.c), an edge is drawn by its
 * length,
 *
 *     dI = int dl sin(phi)/r^2 f cos_x [L(-) - L(+)] m.(V - V_line),   r = |p - x|,
 *
 * and x slides along the ray. So does a curve where the shading normal of a mesh turns away from x
 * (boundary_shading.c). Other vertices are connected to x (boundary_reach.c). */
#include "boundary_allowed.h"
#include "kind/cleared.h"
#include "scene/located.h"
#include "walk/core/step.h"
#include "walk/lights/light_step.h"

static void ray_through(const struct imp__boundary *b, double time, double px, double py,
                        struct imp__edge_ray *out)
{
    const struct imp_sensor *s = b->tracer->sensor;
    struct imp_sensor_ray ray;
    s->ops->ray(s, px, py, (const double[2]){0.5, 0.5}, &ray);
    *out = (struct imp__edge_ray){.o = ray.o, .d = ray.d, .px = px, .py = py};
    out->meets = imp__intersect_at(b->tracer->scene, time, &ray.o, &ray.d, ray.t_near,
                                   ray.t_far, &out->hit);
    if (out->meets)
        imp__hit_surface(b->tracer->scene, &out->hit, &ray.o, &ray.d, &out->at);
}

void imp__ray_looked_at(const struct imp__boundary *b, imp_v3 *at)
{
    const struct imp_film_desc *film = &b->tracer->sensor->film;
    struct imp__edge_ray ray;
    ray_through(b, b->tracer->sensor->open, 0.5 * film->width, 0.5 * film->height, &ray);
    if (ray.meets) *at = ray.at.p;
}

void imp__ray_draw(struct imp__edge_draw *d)
{
    const struct imp_film_desc *film = &d->b->tracer->sensor->film;
    ray_through(d->b, d->time, d->lens[0] * film->width, d->lens[1] * film->height,
                &d->ray);
    d->eye = d->ray.o;
}

enum imp_status imp__rays_allowed(const struct imp__boundary *b)
{
    const struct imp_sensor *s = b->tracer->sensor;
    struct imp__edge_ray ray;
    const char *why = !b->rays     ? NULL
                      : b->fog     ? "reads along single rays in a medium"
                      : b->mirrors ? "reads along single rays, and the scene has mirrors"
                      : b->passes
                          ? "reads along single rays, and a material of the scene lets "
                            "light straight through"
                          : NULL;
    for (int y = 0; b->rays && !why && y < s->film.height; y++)
        for (int x = 0; !why && x < s->film.width; x++) {
            ray_through(b, s->open, x + 0.5, y + 0.5, &ray);
            if (ray.meets && imp__moves_smooth(b->tracer->scene, ray.hit.shape))
                why = "reads along a ray that meets a mesh with vertex normals "
                      "(face_normals makes it flat)";
        }
    return why ? imp__error(b->tracer->scene->ctx, IMP_E_UNSUPPORTED,
                            "derivatives by what moves: sensor '%s' (%s) %s", s->name,
                            s->ops->name, why)
               : IMP_OK;
}

imp_spec imp__ray_receives(const struct imp__edge_draw *d, imp_v3 w)
{
    const struct imp_scene *scene = d->b->tracer->scene;
    const struct imp__edge_ray *ray = &d->ray;
    const struct imp_shape *shape =
        scene->shapes[imp__placed_shape(scene, ray->hit.shape, ray->hit.place)];
    const struct imp_bsdf *b = imp__shape_bsdf(scene, shape);
    const struct imp_texcoord place = {.uv = {ray->at.uv[0], ray->at.uv[1]},
                                       .p = ray->at.p,
                                       .shape = shape,
                                       .prim = ray->hit.prim,
                                       .carried = imp__edge_waves(d)};
    const struct imp_frame frame = {ray->at.s, ray->at.t, ray->at.n};
    const struct imp_dirs dirs = {imp__to_local(&frame, -ray->d),
                                  imp__to_local(&frame, w), IMP_SMOOTH, 0};
    imp_spec in[IMP_INPUTS_MAX], f;
    imp__evaluate_inputs(b, shape, &place, in);
    b->ops->eval(b, in, &dirs, &f);
    return f;
}

void imp__ray_point_ends(const struct imp__edge_draw *d, imp_v3 shift,
                         struct imp__flux *f)
{
    const struct imp_scene *scene = d->b->tracer->scene;
    const struct imp__edge_ray *ray = &d->ray;
    const struct imp_shape *shape =
        scene->shapes[imp__placed_shape(scene, ray->hit.shape, ray->hit.place)];
    const struct imp_located located =
        imp__located_hit(scene, shape, &ray->hit, &ray->at);
    struct imp__link_point x = imp__surface_point(scene, ray->hit.shape, &located,
                                                  ray->hit.place, d->time, ray->at.ng);
    x.moved_bar = shift;
    const imp_v3 on_ray = imp__slide_bar(&x, ray->d, NULL);
    f->end[f->n_ends++] = imp__flux_glued(&x.x, x.bar.v);
    f->end[f->n_ends++] = imp__flux_camera(d, &x.x, on_ray);
}

struct imp__flux *imp__ray_jump_add(struct imp__edge_draw *d, imp_spec L)
{
    const struct imp_sensor_sample to = {.px = d->ray.px, .py = d->ray.py};
    return imp__jump_add(d, &to, L, IMP_EDGE_ENDS + 3);
}

/* Emission that a look past the edge meets first, of a light at y (boundary_meter.c). */
static void emission_add(struct imp__edge_draw *d, const struct imp_walk *walk, imp_v3 m,
                         imp_spec times)
{
    imp_spec T;
    const struct imp_vertex *v = imp__walk_met(d, walk, &T);
    if (!v) return;
    struct imp__flux *f = imp__ray_jump_add(d, T * v->e * times);
    if (!f) return;
    f->n_ends = imp__edge_ends(d, m, f->end);
    const struct imp__glued y =
        imp__glued_at(d->b->tracer->scene, v->d.shape, &v->d.located, 0, d->time, v->ng);
    const imp_v3 x = d->ray.at.p;
    const double far =
        imp_clamp(1 - imp__length(d->p - x) / imp__length(y.p - x), 0.0, 1.0);
    f->end[f->n_ends++] = imp__flux_glued(&y, m * (far - 1));
    imp__ray_point_ends(d, m * -far, f);
}

static void look_beside(struct imp__edge_draw *d, imp_v3 o, imp_v3 m, double apart,
                        struct imp_walk *walk)
{
    if (imp__edge_face_look(d, o, false, m, apart, 1, walk)) return;
    imp__look_from(d, &d->ray.at, imp__edge_beside(d, d->p - o, m, apart), 1, walk);
}

void imp__draw_ray(struct imp__edge_draw *d)
{
    const struct imp_film_desc *film = &d->b->tracer->sensor->film;
    const int max = d->b->tracer->integrator->max_depth;
    const imp_v3 x = d->ray.at.p;
    if (!d->ray.meets || (max >= 0 && max < 2) || !imp__edge_any(d, x, false)) return;
    const imp_v3 r = d->p - x, turned = imp__cross(d->along, r);
    const double distance = imp__length(r);
    if (!(imp__length(turned) > 0)) return;
    const imp_spec times = imp__ray_receives(d, r * (1 / distance)) *
                           (film->width * film->height * d->inv_pdf *
                            imp__length(turned) / (distance * distance * distance));
    if (imp__is_zero_used(times, d->waves)) return;
    const imp_v3 o = imp__offset(x, d->ray.at.ng, r), to = imp__edge_clear(d) - o;
    const double apart = IMP_BESIDE * (imp__length(to) + imp__length(d->p));
    imp_spec T;
    if (imp__edge_merges(d, to, apart) || imp__edge_is_hidden(d, o, to, &T)) return;
    const imp_v3 m = imp__normalize(turned);
    struct imp_walk lo, hi;
    look_beside(d, o, -m, apart, &lo);
    look_beside(d, o, m, apart, &hi);
    const struct imp__seen_from from = {.before = 1};
    const imp_spec jump = imp__arrives(d->b, &lo, from) - imp__arrives(d->b, &hi, from);
    struct imp__flux *f = imp__ray_jump_add(d, jump * times);
    if (f) {
        f->n_ends = imp__edge_ends(d, m, f->end);
        imp__ray_point_ends(d, -m, f);
    }
    emission_add(d, &lo, m, times);
    emission_add(d, &hi, m, -times);
}
