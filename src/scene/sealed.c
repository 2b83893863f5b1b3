/* SPDX-License-Identifier: Apache-2.0
 *
 * Which media are sealed (sealed.h). A surface is closed where each of its edges is passed in both
 * directions equally often. Around points outside of its box it winds 0 times, around points that its
 * outward normals have behind them once: a line between the two passes it. Collisions in the medium
 * behind it lie at such points, since walks are dropped where the side of a boundary that they meet is
 * not the one of their medium (tracking.c). */
#include "sealed.h"
#include "math/rng.h"
#include "pose.h"
#include "scene_build.h"
#include <string.h>

extern const struct imp_shape_ops imp__sphere;

/* ---- Closed surfaces ----------------------------------------------------------------- */

/* By its place: vertices that files repeat count as one; welded: each is another one. */
static uint64_t vertex_hash(const float *positions, uint32_t index, bool welded)
{
    uint64_t h = 0;
    if (welded) return imp__mix64(index + 0x9e3779b97f4a7c15u);
    for (int c = 0; c < 3; c++) {
        const float x =
            positions[3 * (size_t)index + (size_t)c] + 0.0F; /* -0 becomes 0 */
        uint32_t bits;
        memcpy(&bits, &x, sizeof bits);
        h = imp__mix64(h ^ (bits + 0x9e3779b97f4a7c15u));
    }
    return h;
}

static uint64_t edge_hash(uint64_t from, uint64_t to)
{
    return imp__mix64(imp__mix64(from + 0xd1b54a32d192ed03u) ^ to);
}

/* The sum over edges of a hash of each, less that of the edge turned round, is 0 where all have
 * a counterpart; else it is 0 with a probability of 2^-64. */
static bool is_closed_mesh(const struct imp_triangles *m, bool welded)
{
    uint64_t sum = 0;
    for (size_t k = 0; k < m->n_triangles; k++) {
        uint64_t v[3];
        for (int c = 0; c < 3; c++)
            v[c] = vertex_hash(m->positions, m->indices[3 * k + (size_t)c], welded);
        for (int c = 0; c < 3; c++)
            sum += edge_hash(v[c], v[(c + 1) % 3]) - edge_hash(v[(c + 1) % 3], v[c]);
    }
    return sum == 0;
}

bool imp__is_welded(const struct imp_triangles *m) { return is_closed_mesh(m, true); }

/* Are the mesh's normals outward? By its volume, as it is now. */
static bool is_outward_mesh(const struct imp_triangles *m)
{
    double volume = 0;
    for (size_t k = 0; k < m->n_triangles; k++) {
        imp_v3 r[3] = {{0}, {0}, {0}};
        for (int c = 0; c < 3; c++) {
            const float *p = m->positions + 3 * (size_t)m->indices[3 * k + (size_t)c],
                        *o = m->positions + 3 * (size_t)m->indices[0];
            for (int i = 0; i < 3; i++) r[c][i] = (double)p[i] - (double)o[i];
        }
        volume += imp__dot(r[0], imp__cross(r[1], r[2]));
    }
    return volume > 0;
}

/* Are the sphere's normals outward? By a ray from its middle. */
static bool is_outward_sphere(const struct imp_shape *s)
{
    const imp_v3 o = (s->lo + s->hi) * 0.5, d = {0, 0, 1, 0};
    struct imp_surface at;
    struct imp_hit hit;
    if (!s->ops->intersect(s, &o, &d, 0, INFINITY, &hit)) return false;
    s->ops->surface(s, &hit, &o, &d, &at);
    return at.ng[2] > 0;
}

/* Closed, with normals that point outwards. */
static bool is_closed(const struct imp_shape *s)
{
    if (s->ops == &imp__sphere) return is_outward_sphere(s);
    return s->geometry == IMP_TRIANGLES && is_outward_mesh(&s->triangles) &&
           is_closed_mesh(&s->triangles, false);
}

/* ---- Lights outside ------------------------------------------------------------------- */

static bool apart(imp_v3 lo, imp_v3 hi, const struct imp_shape *s)
{
    for (int c = 0; c < 3; c++)
        if (hi[c] < s->lo[c] || lo[c] > s->hi[c]) return true;
    return false;
}

static bool is_outside(const struct imp_emitter *e, const struct imp_shape *s)
{
    if (e->shape) return apart(e->shape->lo, e->shape->hi, s);
    if (e->ops->flags & (IMP_EMITTER_ENVIRONMENT | IMP_EMITTER_FAR)) return true;
    /* A sample of a light at a point has its place. */
    const imp_v3 ref = (s->lo + s->hi) * 0.5;
    const double u[2] = {0.5, 0.5};
    struct imp_light_sample there;
    there.located.prim = -1;
    return e->ops->flags & IMP_EMITTER_DELTA && e->ops->sample(e, &ref, u, &there) &&
           apart(there.p, there.p, s);
}

/* Nothing that bounds m lets light go straight on, and no light lies in it. */
static bool is_bound(const struct imp_scene *scene, const struct imp_medium *m)
{
    bool any = false;
    for (int k = 0; k < scene->n_all_shapes; k++) {
        const struct imp_shape *s = scene->shapes[k];
        const struct imp_bsdf *b = imp__shape_bsdf(scene, s);
        if (s->exterior == m) return false;
        if (s->interior != m) continue;
        if (b->straight || b->flags & IMP_BSDF_NULL || s->emitter >= 0) return false;
        for (int e = 0; e < scene->n_emitters; e++)
            if (!is_outside(scene->emitters[e], s)) return false;
        if (!scene->closed[k]) return false;
        any = true;
    }
    for (int k = 0; k < scene->n_sensors; k++)
        if (scene->sensors[k]->medium == m) return false;
    return any;
}

static void closed_find(struct imp_scene *scene, int shape)
{
    const struct imp_shape *s = scene->shapes[shape];
    scene->closed[shape] = (s->interior || s->exterior) && is_closed(s);
}

/* A vertex that is repeated opens a mesh where it moves alone, and a matrix may mirror a shape; other
 * poses do neither. */
void imp__sealed_renew(struct imp_scene *scene)
{
    for (const struct imp_pose *p = scene->closed ? scene->poses : NULL; p; p = p->next)
        if (p->shape >= 0 && (p->kind == IMP_POSE_VERTICES || p->kind == IMP_POSE_WORLD))
            closed_find(scene, p->shape);
    const bool known = !scene->media_open && !scene->priorities && !scene->world;
    for (int k = 0; scene->sealed && k < scene->n_media; k++)
        scene->sealed[k] = known && is_bound(scene, scene->media[k]);
}

enum imp_status imp__sealed_create(struct imp_scene *scene)
{
    if (scene->n_media == 0) return IMP_OK;
    scene->sealed = imp__arena_array(&scene->arena, (size_t)scene->n_media, sizeof(bool));
    scene->closed =
        imp__arena_array(&scene->arena, (size_t)scene->n_all_shapes + 1, sizeof(bool));
    if (!scene->sealed || !scene->closed) return imp__build_no_memory(scene);
    for (int k = 0; k < scene->n_all_shapes; k++) closed_find(scene, k);
    imp__sealed_renew(scene);
    return IMP_OK;
}
