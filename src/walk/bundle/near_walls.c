/* SPDX-License-Identifier: Apache-2.0
 *
 * Which points of a grid lie near walls: by a few directions, the same for each. */
#include "near_walls.h"
#include "columns.h"
#include "kind/sensor/receiver.h"
#include "math/offset.h"
#include "math/warp.h"
#include "meter_lanes.h"

/* Directions; walks that give, where so many of them meet something nearer than the next point. In a
 * room with points at half their distance from the walls that is an eighth to a fifth of the light. */
enum { RAYS = 32, FEW = 2, MANY = 3 };
static int walks_of(int met) { return (met >= FEW) + (met >= MANY); }

static imp_v3 point_of(const struct imp_sensor *s, int x, int y, imp_v3 *normal)
{
    struct imp_surface at;
    double uv[2];
    imp__receiver_uv(s, s->film.crop_x + x + 0.5, s->film.crop_y + y + 0.5, uv);
    s->shape->ops->sample_area(s->shape, uv, &at);
    *normal = at.ng;
    return at.p;
}

/* From p, the point of pixel (x, y), to the nearest of the pixels beside it; 0: there are none. */
static double spacing(const struct imp_sensor *s, int x, int y, imp_v3 p)
{
    static const int beside[4][2] = {{-1, 0}, {1, 0}, {0, -1}, {0, 1}};
    double least = INFINITY;
    for (int k = 0; k < 4; k++) {
        const int i = x + beside[k][0], j = y + beside[k][1];
        imp_v3 n;
        if (i < 0 || j < 0 || i >= s->film.crop_w || j >= s->film.crop_h) continue;
        least = imp_min(least, imp__length(point_of(s, i, j, &n) - p));
    }
    return least < INFINITY ? least : 0;
}

/* Direction k of them, by the cosine: Hammersley's points. */
static imp_v3 direction(int k)
{
    double v = 0.5 / RAYS, part = 0.5;
    for (int bits = k; bits; bits >>= 1, part *= 0.5) v += part * (bits & 1);
    return imp__cosine_hemisphere((const double[2]){(k + 0.5) / RAYS, v});
}

static int near_of(const struct imp_tracer *t, int x, int y, struct imp_ray_columns *rays)
{
    bool hidden[RAYS + IMP_COLUMN_SLACK];
    imp_v3 normal;
    const imp_v3 p = point_of(t->sensor, x, y, &normal);
    const double far = spacing(t->sensor, x, y, p);
    const struct imp_frame frame = imp__frame_from_normal(normal);
    if (!(far > 0)) return 0;
    for (int k = 0; k < RAYS; k++) {
        const imp_v3 d = imp__to_world(&frame, direction(k));
        imp__column_put(rays->o, k, imp__offset(p, normal, d));
        imp__column_put(rays->d, k, d);
        rays->far[k] = far;
    }
    rays->n = RAYS;
    imp__occluded_columns(t->scene, rays, hidden);
    int met = 0;
    for (int k = 0; k < RAYS; k++) met += hidden[k];
    return walks_of(met);
}

enum imp_status imp__near_walls(const struct imp_tracer *t, uint8_t **more)
{
    const struct imp_film_desc *film = &t->sensor->film;
    imp_context *ctx = t->scene->ctx;
    const size_t pixels = (size_t)film->crop_w * (size_t)film->crop_h;
    struct imp_ray_columns rays;
    struct imp_arena arena;
    *more = NULL;
    if (!imp__meter_in_lanes(t)) return IMP_OK;
    imp__arena_init(&arena, ctx);
    uint8_t *own = imp__alloc(ctx, pixels, sizeof *own);
    const bool ok = own && imp__rays_create(&arena, RAYS, &rays);
    if (ok) rays.near = rays.time = NULL;
    if (ok) rays.instant = t->sensor->open;
    for (int y = 0; ok && y < film->crop_h; y++)
        for (int x = 0; x < film->crop_w; x++)
            own[(size_t)y * (size_t)film->crop_w + (size_t)x] =
                (uint8_t)near_of(t, x, y, &rays);
    imp__arena_free(&arena);
    if (!ok) {
        imp__release(ctx, own);
        return imp__error(ctx, IMP_E_NOMEM, "no memory for the points of a grid");
    }
    *more = own;
    return IMP_OK;
}
