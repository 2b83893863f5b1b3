/* SPDX-License-Identifier: Apache-2.0
 *
 * The intersector of a scene: Embree's device and its scenes.
 *
 * One device, made on first use and kept until the process ends (a child that was forked in a
 * build makes another): Embree's thread library makes a thread when a device is released, or
 * when a second one is made, and ends the process if it cannot. Large scenes are built by all
 * threads of the context, if they are at no loop, which join the commit, others in the thread
 * that commits: Embree makes no thread, since all places of its arena (`user_threads`) are for
 * those that come by themselves.
 *
 * Embree cuts its work by the number of these places, whichever threads join, so a tree
 * is the same on any number of threads. On another number of processors the triangles of
 * a leaf (no more than four; in trees of some thousand) may be in another order, which
 * decides between two of them that a ray meets at exactly the same distance. */
#include "base/pool.h"
#include "instances.h"
#include "intersector.h"
#include "kind/sensor/receiver.h"
#include "math/offset.h"
#include <sched.h>
#include <stdatomic.h>
#include <stdio.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

/* Memory and errors of one commit, inside build_enter: Embree calls back in any thread that
 * builds. */
static struct commit {
    _Atomic int64_t bytes;
    _Atomic int error;  /* enum RTCError; the first counts */
    _Atomic bool begun; /* threads can join */
    char message[256];
} told;

static void error_keep(void *user, enum RTCError error, const char *text)
{
    int none = RTC_ERROR_NONE;
    (void)user;
    if (!atomic_compare_exchange_strong(&told.error, &none, (int)error)) return;
    snprintf(told.message, sizeof told.message, "%s", text ? text : "");
}

static bool bytes_count(void *user, ssize_t bytes, bool post)
{
    (void)user, (void)post;
    atomic_fetch_add(&told.bytes, bytes);
    atomic_store(&told.begun, true);
    return true;
}

static void told_clear(void)
{
    atomic_store(&told.bytes, 0);
    atomic_store(&told.error, RTC_ERROR_NONE);
    told.message[0] = 0;
}

static enum imp_status device_error(imp_context *ctx, enum RTCError error,
                                    const char *text)
{
    const char *colon = *text ? ": " : "";
    if (error == RTC_ERROR_OUT_OF_MEMORY)
        return imp__error(ctx, IMP_E_NOMEM, "out of memory for Embree%s%s", colon, text);
    return imp__error(ctx, IMP_E_UNSUPPORTED, "Embree: error %d%s%s", (int)error, colon,
                      text);
}

#define BUILDERS_MAX 64 /* places: Embree cuts nothing into more pieces */
static RTCDevice device;
static _Atomic long builder; /* process of the thread that is with Embree; 0: none */

/* One thread at a time makes the device, a scene, or releases one. Not a mutex: the process
 * may be forked while a thread is here, and then the child takes its place. */
static void build_enter(void)
{
    const long here = (long)getpid();
    for (;;) {
        long by = 0;
        if (atomic_compare_exchange_strong(&builder, &by, here)) return;
        if (by != here && atomic_compare_exchange_strong(&builder, &by, here)) {
            device = NULL; /* its arena may be full of threads that are not here */
            return;
        }
        nanosleep(&(struct timespec){0, 100000}, NULL);
    }
}
static void build_leave(void) { atomic_store(&builder, 0); }

/* Inside build_enter. */
static enum imp_status device_get(imp_context *ctx, RTCDevice *out)
{
    enum imp_status st = IMP_OK;
    if (!(*out = device)) {
        char config[64];
        long threads = sysconf(_SC_NPROCESSORS_ONLN);
        threads = threads < 1 ? 1 : threads > BUILDERS_MAX ? BUILDERS_MAX : threads;
        snprintf(config, sizeof config,
                 "threads=%ld,user_threads=%ld,ignore_config_files=1", threads, threads);
        *out = rtcNewDevice(config);
        if (*out) {
            rtcSetDeviceErrorFunction(*out, error_keep, NULL);
            rtcSetDeviceMemoryMonitorFunction(*out, bytes_count, NULL);
        } else {
            st = device_error(ctx, rtcGetDeviceError(NULL), "");
        }
        device = *out;
    }
    return st;
}

/* Does light travel on the inner side of the mesh: in a room, a body of glass, a medium?
 * Among 10^8 rays in closed rooms and through bodies, 22 slip between two triangles without
 * Embree's robust flag, 20 of them in rooms of 20,480 triangles; 1 slips with the flag
 * everywhere, and 1 by this rule (tests/stat/leaks.c long): of triangles that are alone in
 * Embree's tree. Of 6 10^7 rays in rooms and through bodies of 20,172 that are folded pairs
 * (tree_quads.h) 1 slips by this rule. A ray that slips into an opaque body is lost to the
 * picture as if it were black there.
 * Rays without the flag take three quarters of the instructions.
 *
 * Walks in a medium trace many rays from its inside, often near its boundary: of 262,144
 * walks in a slab of 12 large triangles 32 left it without the flag, none with it. */
#define FEW 64
static bool is_boundary(const struct imp_scene *scene, const struct imp_shape *s)
{
    const struct imp_bsdf *b = imp__shape_bsdf(scene, s);
    if (s->geometry != IMP_TRIANGLES) return false;
    if (s->interior || s->exterior) return true; /* walks stay inside for long */
    if (s->triangles.n_triangles <= FEW) return false;
    if (s->body || (b->flags & (IMP_BSDF_TRANSMIT | IMP_BSDF_NULL))) return true;
    if (b->n_child > 0) return true; /* two-sided */
    const imp_v3 size = s->hi - s->lo;
    return s->triangles.volume < -0.05 * (size[0] * size[1] * size[2]);
}

/* What an intersector is made of: n shapes of the scene from `first` on and the instances
 * of a group, or the aims'. */
struct content {
    const struct imp_aims *aims;
    const struct imp_group *group; /* NULL: no instances */
    int first, n;
};

static const struct imp_shape *shape_at(const struct imp_scene *scene,
                                        const struct content *c, int i)
{
    return c->aims ? c->aims->list[i].shape : scene->shapes[c->first + i];
}

/* With a material of an instance, too. */
static bool is_robust(const struct imp_scene *scene, const struct content *c)
{
    for (int i = 0; !c->aims && i < c->n; i++)
        if (is_boundary(scene, shape_at(scene, c, i))) return true;
    for (int k = 0; !c->aims && k < scene->n_covered; k++) {
        const struct imp_covered *cover = scene->covered[k];
        for (int i = 0; i < cover->group->n_within; i++) {
            const int within = cover->group->within[i] - c->first;
            if (within >= 0 && within < c->n &&
                is_boundary(scene, scene->shapes[cover->first + i]))
                return true;
        }
    }
    return c->aims != NULL;
}

/* In one commit all workers build. The first item begins; one that came before it would
 * begin, too, but one that came before there is work would not stay. */
static enum imp_status tree_join(size_t i, int worker, int slot, void *rtc)
{
    (void)worker, (void)slot;
    while (i > 0 && !atomic_load(&told.begun)) sched_yield();
    rtcJoinCommitScene(rtc);
    atomic_store(&told.begun, true);
    return IMP_OK;
}

#define PRIMITIVES_FEW 32768 /* not worth other threads */
static void tree_build(imp_context *ctx, RTCScene rtc, size_t primitives)
{
    const struct imp_loop loop = {
        .n_items = (size_t)ctx->threads, .work = tree_join, .payload = rtc};
    enum imp_status st;
    atomic_store(&told.begun, false);
    /* Inside build_enter, where others wait: it may not wait for another's loop. */
    if (primitives < PRIMITIVES_FEW || !imp__parallel_try(ctx, &loop, &st) ||
        st != IMP_OK)
        rtcJoinCommitScene(rtc); /* of what is built it does nothing */
}

static size_t primitives_of(const struct imp_shape *s)
{
    return s->geometry == IMP_TRIANGLES ? s->triangles.n_triangles
           : s->geometry == IMP_CURVES  ? s->curves.n_segments
                                        : 1;
}

static bool is_few(const struct imp_scene *scene, const struct content *c)
{
    int n = 0;
    for (int i = 0; !c->aims && i < c->n; i++)
        n += shape_at(scene, c, i)->geometry == IMP_ANALYTIC;
    return !c->aims && n <= IMP_SHAPE_BALLS;
}

/* Trees of low quality, along Morton's curve, are made in a third of the time. In a room of 200,000
 * triangles that is 25 ms less, and 2.9 us more for each walk: they are ahead with fewer walks than a
 * twentieth of the triangles, and are made for half as many. */
#define WALKS_FEW 40 /* times as many triangles */
static bool is_brief(const struct imp_scene *scene, const struct content *c)
{
    double walks = 0, triangles = 0;
    if (scene->spp == 0 || c->aims || c->group != scene->world) return false;
    for (int k = 0; k < scene->n_sensors; k++) {
        const struct imp_film_desc *film = &scene->sensors[k]->film;
        walks += (double)scene->spp * film->crop_w * film->crop_h;
    }
    for (int i = 0; i < c->n; i++)
        triangles += (double)primitives_of(shape_at(scene, c, i));
    return WALKS_FEW * walks < triangles;
}

static void intersector_free(imp_context *ctx, struct imp_intersector *x)
{
    imp__facets_destroy(ctx, x->facets);
    for (int i = 0; i < x->n_quads; i++) imp__tree_quads_destroy(ctx, x->quads[i]);
    imp__release(ctx, x->quads);
    imp__release(ctx, x);
}

/* Aims, whose hits are gathered one by one, stay triangles. False: out of memory. */
static bool quads_create(const struct imp_scene *scene, const struct content *c,
                         struct imp_intersector *x)
{
    if (c->aims || x->facets || c->n == 0) return true;
    x->quads = imp__alloc(scene->ctx, (size_t)c->n, sizeof(struct imp_tree_quads *));
    if (!x->quads) return false;
    x->n_quads = c->n;
    for (int i = 0; i < c->n; i++) {
        const struct imp_shape *s = shape_at(scene, c, i);
        if (s->geometry == IMP_TRIANGLES && !imp__shape_is_absent(s) &&
            !imp__tree_quads_create(scene->ctx, &s->triangles, &x->quads[i], &x->bytes))
            return false;
    }
    return true;
}

static enum imp_status intersector_make(struct imp_scene *scene, const struct content *c,
                                        void **out)
{
    enum imp_status st = IMP_OK;
    RTCDevice rtc;

    build_enter();
    IMP_TRY(device_get(scene->ctx, &rtc));
    struct imp_intersector *x = imp__alloc(scene->ctx, 1, sizeof *x);
    if (!x)
        IMP_TRY(imp__error(scene->ctx, IMP_E_NOMEM, "out of memory for the intersector"));

    /* Where analytic shapes are in the tree, it decides which of two at one place is met. */
    const bool few = is_few(scene, c);
    if ((few && c->n > 0 &&
         !imp__facets_create(scene->ctx, scene->shapes + c->first, c->n, &x->facets,
                             &x->bytes)) ||
        !quads_create(scene, c, x)) {
        intersector_free(scene->ctx, x);
        IMP_TRY(imp__error(scene->ctx, IMP_E_NOMEM, "out of memory for triangles"));
    }
    told_clear();
    x->first = c->first;
    x->rtc = rtcNewScene(rtc);
    if (x->rtc)
        rtcSetSceneFlags(
            x->rtc, (is_robust(scene, c) ? RTC_SCENE_FLAG_ROBUST : RTC_SCENE_FLAG_NONE) |
                        (c->aims ? RTC_SCENE_FLAG_CONTEXT_FILTER_FUNCTION : 0));
    x->brief = is_brief(scene, c);
    if (x->rtc && x->brief) rtcSetSceneBuildQuality(x->rtc, RTC_BUILD_QUALITY_LOW);
    const bool instances = c->group && c->group->n_instances > 0;
    size_t primitives = 0;
    bool curves = false;
    for (int i = 0; x->rtc && i < c->n + instances && told.error == RTC_ERROR_NONE; i++) {
        const struct imp_shape *s = i < c->n ? shape_at(scene, c, i) : NULL;
        if (s && imp__shape_is_absent(s)) continue;
        if (s && s->geometry == IMP_ANALYTIC && few) {
            imp__shape_balls_add(&x->balls, s);
            continue;
        }
        if (s && s->geometry == IMP_TRIANGLES && x->facets) continue;
        RTCGeometry g = s ? imp__geometry_create(rtc, s, x->quads ? x->quads[i] : NULL,
                                                 c->aims != NULL, x->brief)
                          : imp__instances_create(rtc, c->group);
        if (!g) break;
        rtcAttachGeometryByID(x->rtc, g, (unsigned)i);
        rtcReleaseGeometry(g); /* the scene holds it now */
        x->holds = true;
        primitives += s ? primitives_of(s) : (size_t)c->group->n_instances;
        x->calls_back |= !s || s->geometry == IMP_ANALYTIC;
        curves |= s && s->geometry == IMP_CURVES;
    }
    x->packets = x->holds && !x->calls_back && !curves &&
                 rtcGetDeviceProperty(rtc, RTC_DEVICE_PROPERTY_NATIVE_RAY8_SUPPORTED);
    if (x->rtc && told.error == RTC_ERROR_NONE)
        tree_build(scene->ctx, x->rtc, primitives);
    const enum RTCError error = !x->rtc && told.error == RTC_ERROR_NONE
                                    ? RTC_ERROR_UNKNOWN
                                    : (enum RTCError)told.error;
    x->bytes += told.bytes;
    if (error != RTC_ERROR_NONE) {
        if (x->rtc) rtcReleaseScene(x->rtc);
        intersector_free(scene->ctx, x);
        IMP_TRY(device_error(scene->ctx, error, told.message));
    }
    *out = x;
out:
    build_leave();
    return st;
}

enum imp_status imp__intersector_create(struct imp_scene *scene)
{
    enum imp_status st = IMP_OK;
    for (int k = 0; k < scene->n_groups; k++) { /* those inside others come first */
        struct imp_group *g = scene->groups[k];
        const struct content c = {.group = g, .first = g->first, .n = g->n_shapes};
        if (g->intersector) continue;
        IMP_TRY(intersector_make(scene, &c, &g->intersector));
    }
    const struct content c = {.group = scene->world, .n = scene->n_shapes};
    IMP_TRY(intersector_make(scene, &c, &scene->intersector));
out:
    return st;
}
enum imp_status imp__aims_commit(struct imp_scene *scene)
{
    struct imp_aims *t = &scene->aims;
    const struct content c = {.aims = t, .n = t->n};
    return intersector_make(scene, &c, &t->intersector);
}

static void intersector_release(struct imp_scene *scene, void **intersector)
{
    struct imp_intersector *x = *intersector;
    if (!x) return;
    build_enter();
    rtcReleaseScene(x->rtc);
    build_leave();
    intersector_free(scene->ctx, x);
    *intersector = NULL;
}
enum imp_status imp__intersector_renew(struct imp_scene *scene)
{
    intersector_release(scene, &scene->intersector);
    return imp__intersector_create(scene);
}
void imp__intersector_destroy(struct imp_scene *scene)
{
    intersector_release(scene, &scene->intersector);
    intersector_release(scene, &scene->aims.intersector);
    for (int k = 0; k < scene->n_groups; k++)
        intersector_release(scene, &scene->groups[k]->intersector);
}

static size_t bytes_of(const struct imp_intersector *x)
{
    return x && x->bytes > 0 ? (size_t)x->bytes : 0;
}
size_t imp__intersector_bytes(const struct imp_scene *scene)
{
    size_t bytes = bytes_of(scene->intersector) + bytes_of(scene->aims.intersector);
    for (int k = 0; k < scene->n_groups; k++)
        bytes += bytes_of(scene->groups[k]->intersector);
    return bytes;
}
