/* SPDX-License-Identifier: Apache-2.0
 *
 * One mesh of 87,362 triangles at 10,000 places, 8.7e8 effective triangles: as instances of
 * the mesh, and as 100 instances of a group of 100. Ray by ray the same hit as among all
 * places, each of which is asked by itself; and what instances take beyond the mesh, of the
 * first kind at 40,000 places. */
#include "imp_scene.h"
#include "imp_tap.h"
#include "math/rng.h"
#include "math/transform.h"
#include "scene/instances.h"
#include <malloc.h>
#include <stdbool.h>
#include <time.h>
#include <unistd.h>

#define SIDE   209 /* squares along a side of the mesh, of two triangles each */
#define GROUP  100
#define PLACES 10000
#define MANY   40000
#define RAYS   1500

static imp_context *ctx;

/* ---- What stands where ---------------------------------------------------------------- */

/* A bent leaf of 1 x 1. */
static void mesh_put(imp_scene *s)
{
    static float p[3 * (SIDE + 1) * (SIDE + 1)];
    static uint32_t index[6 * SIDE * SIDE];
    size_t n = 0, k = 0;
    for (int j = 0; j <= SIDE; j++)
        for (int i = 0; i <= SIDE; i++, n++) {
            const double x = (double)i / SIDE - .5, y = (double)j / SIDE - .5;
            const double z = .3 * cos(3 * x) * cos(4 * y) + .02 * sin(40 * x + 30 * y);
            p[3 * n] = (float)x, p[3 * n + 1] = (float)y, p[3 * n + 2] = (float)z;
        }
    for (uint32_t j = 0; j < SIDE; j++)
        for (uint32_t i = 0; i < SIDE; i++) {
            const uint32_t a = j * (SIDE + 1) + i, b = a + SIDE + 1;
            const uint32_t corner[6] = {a, a + 1, b + 1, a, b + 1, b};
            memcpy(index + 6 * k++, corner, sizeof corner);
        }
    imp_scene_begin(s, "shape", "mesh", NULL, NULL);
    imp_scene_mesh(s, n, 2 * k, p, NULL, NULL, index);
    imp_scene_end(s);
}

static struct imp_mat4 times(struct imp_mat4 a, struct imp_mat4 b)
{
    return imp__mat4_multiply(&a, &b);
}
/* A square of 10 x 10, `apart` from each other, turned and scaled each in its way. */
static struct imp_mat4 place_of(int k, double apart, double size)
{
    const double t = 2.399963 * k;
    const imp_v3 axis = imp__normalize(imp__v3(sin(t), cos(t), .7));
    return times(imp__translate(imp__v3(apart * (k % 10), apart * (k / 10), sin(5 * t))),
                 times(imp__rotate(axis, 50 * t),
                       imp__scale(imp__v3(1, 1 + .2 * cos(t), 1) * size)));
}
static struct imp_mat4 inner(int k) { return place_of(k, 1.4, 1); }
static struct imp_mat4 outer(int k) { return place_of(k, 15, 1.1); }

static void instance_put(imp_scene *s, const char *group, struct imp_mat4 at)
{
    imp_scene_begin(s, "shape", "instance", NULL, NULL);
    imp_scene_ref(s, group, NULL);
    imp_scene_transform(s, "to_world", at.m);
    imp_scene_end(s);
}

enum how { MESH, ONE, FLAT, NESTED, MORE };

static imp_scene *scene_of(enum how how)
{
    imp_scene *s;
    test_must(ctx, imp_scene_create(ctx, NULL, &s));
    test_camera(s, 300, 40, 8, 8);
    imp_scene_begin(s, "emitter", "constant", NULL, NULL);
    imp_scene_end(s);
    if (how != MESH) imp_scene_begin(s, "shape", "shapegroup", "leaf", NULL);
    mesh_put(s);
    if (how != MESH) imp_scene_end(s);
    if (how == NESTED) {
        imp_scene_begin(s, "shape", "shapegroup", "tree", NULL);
        for (int k = 0; k < GROUP; k++) instance_put(s, "leaf", inner(k));
        imp_scene_end(s);
        for (int k = 0; k < PLACES / GROUP; k++) instance_put(s, "tree", outer(k));
    }
    const int n = how == MORE ? MANY : how == FLAT ? PLACES : how == ONE;
    for (int k = 0; k < n; k++)
        instance_put(s, "leaf", times(outer(k / GROUP), inner(k % GROUP)));
    test_must(ctx, imp_scene_commit(s));
    return s;
}

/* ---- What it takes -------------------------------------------------------------------- */

/* A sanitizer keeps memory of its own for every block. */
#if defined __SANITIZE_ADDRESS__ || defined __SANITIZE_THREAD__
#define SANITIZED 1
#elif defined __has_feature
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
#define SANITIZED 1
#endif
#endif
#ifndef SANITIZED
#define SANITIZED 0
#endif

static double resident(void)
{
    double pages = 0;
    malloc_trim(0); /* what was given back is not resident */
    FILE *f = fopen("/proc/self/statm", "r");
    if (!f) return 0;
    if (fscanf(f, "%*f %lf", &pages) != 1) pages = 0;
    fclose(f);
    return pages * (double)sysconf(_SC_PAGESIZE);
}

struct cost {
    double held, resident;
};

static imp_scene *built(enum how how, struct cost *cost)
{
    const double before = resident();
    imp_scene *s = scene_of(how);
    struct imp_scene_info info = {.size = sizeof info};
    imp_scene_get_info(s, &info);
    *cost = (struct cost){(double)info.memory_bytes, resident() - before};
    return s;
}

/* ---- Hits ----------------------------------------------------------------------------- */

struct found {
    double t;
    int64_t place; /* of PLACES; -1: none */
    uint32_t prim;
};

static struct imp_map to_local[PLACES];
static imp_v3 centre[PLACES];

static void places_make(void)
{
    for (int k = 0; k < PLACES; k++) {
        const struct imp_mat4 m = times(outer(k / GROUP), inner(k % GROUP));
        const struct imp_map map = imp__map_of(&m);
        imp__map_inverse(&map, &to_local[k]);
        centre[k] = imp__map_point(&map, imp__v3(0, 0, .1));
    }
}

/* The nearest of all places near the ray, in the scene of the mesh alone. */
static struct found nearest(const imp_scene *mesh, imp_v3 o, imp_v3 d)
{
    struct found best = {INFINITY, -1, 0};
    for (int k = 0; k < PLACES; k++) {
        const imp_v3 c = centre[k] - o;
        if (imp__length(c - d * imp__dot(c, d)) > 1.3) continue;
        const imp_v3 o_in = imp__map_point(&to_local[k], o);
        const imp_v3 along = imp__map_vector(&to_local[k], d);
        const double stretch = imp__length(along);
        const imp_v3 d_in = along * (1 / stretch);
        struct imp_hit hit;
        if (!imp__intersect_at(mesh, 0, &o_in, &d_in, 0, INFINITY, &hit)) continue;
        if (hit.t / stretch < best.t) best = (struct found){hit.t / stretch, k, hit.prim};
    }
    return best;
}

/* Number of a place as hits have it (instances.h). */
static int64_t number_of(enum how how, int64_t k)
{
    if (how == FLAT) return k + 1;
    return k / GROUP * (GROUP + 1) + 1 + k % GROUP + 1;
}

static void hits(const char *what, enum how how, const imp_scene *scene,
                 const imp_scene *mesh)
{
    int met = 0, missed = 0, others = 0;
    double worst = 0;
    const imp_v3 middle = imp__v3(73, 73, 0);
    const struct imp_key key = imp__key(11, 0, 0);
    for (unsigned i = 0; i < RAYS; i++) {
        double u[4];
        for (unsigned k = 0; k < 4; k++) u[k] = imp__u01(key, 4 * i + k);
        const imp_v3 from = middle + imp__v3(40 * cos(7 * u[0]), 40 * sin(7 * u[0]), 60);
        const imp_v3 to = imp__v3(145 * u[1], 145 * u[2], u[3]);
        const imp_v3 d = imp__normalize(to - from);
        struct imp_hit hit;
        const bool is = imp__intersect_at(scene, 0, &from, &d, 0, INFINITY, &hit);
        const struct found f = nearest(mesh, from, d);
        if (is != (f.place >= 0) || (is && (hit.place != number_of(how, f.place) ||
                                            (uint32_t)hit.prim != f.prim)))
            others++; /* an edge within rounding */
        else if (is) {
            met++;
            worst = fmax(worst, fabs(hit.t - f.t) / f.t);
        } else missed++;
    }
    tap_ok(
        met > RAYS / 4 && missed > RAYS / 20 && others <= 2 && worst < 1e-5,
        "%s: %d rays meet the same triangle of the same place, within %.1e; %d nothing, "
        "%d others, at edges",
        what, met, worst, missed, others);
}

static double seconds(void)
{
    struct timespec t;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

int main(void)
{
    static const char *const name[] = {"the mesh", "one instance", "10,000 instances",
                                       "100 instances of 100 instances",
                                       "40,000 instances"};
    struct cost one, cost;
    ctx = test_context(1);
    imp_scene *mesh = scene_of(MESH); /* memory that is kept between scenes is there */
    double start = seconds();
    imp_scene_destroy(built(ONE, &one));
    const double one_s = seconds() - start;
    places_make();
    for (int how = FLAT; how <= MORE; how++) {
        start = seconds();
        imp_scene *scene = built((enum how)how, &cost);
        const double more_s = seconds() - start - one_s;
        struct imp_scene_info info = {.size = sizeof info};
        imp_scene_get_info(scene, &info);
        const double n = how == MORE ? MANY : how == FLAT ? PLACES : 2. * GROUP;
        tap_ok(info.triangles_met >= 8.7e8 && info.n_triangles == 2 * SIDE * SIDE,
               "%s: %.4g triangles are met of %.0f", name[how], info.triangles_met,
               (double)info.n_triangles);
        /* Embree takes blocks of up to a megabyte, of which few instances have their share,
         * and the scene's last block is half of all before, whatever is in it yet.
         * What is resident of many has what their building left to the heap, up to 4 MB. */
        const double slack = how == FLAT ? 2e6 : 0;
        tap_ok(cost.held - one.held <= 600 * n + slack &&
                   (SANITIZED || how == MORE ||
                    cost.resident - one.resident <= 600 * n + fmax(1e6, slack)),
               "%s: %.1f MB, %.0f bytes an instance beyond the %.1f MB of one # resident "
               "%.1f and %.1f MB; %.2f s of processor time beyond %.2f",
               name[how], 1e-6 * cost.held, (cost.held - one.held) / n, 1e-6 * one.held,
               1e-6 * cost.resident, 1e-6 * one.resident, more_s, one_s);
        if (how != MORE) hits(name[how], (enum how)how, scene, mesh);
        imp_scene_destroy(scene);
    }
    imp_scene_destroy(mesh);
    imp_context_destroy(ctx);
    return tap_done();
}
