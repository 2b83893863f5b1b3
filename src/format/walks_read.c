/* SPDX-License-Identifier: Apache-2.0
 *
 * Recorded walks read from a file. */
#include "base/arguments.h"
#include "math/hash.h"
#include "walks_file.h"
#include <errno.h>
#include <string.h>

#define MEMORY      ((size_t)1 << 30)
#define BUDGET_MOST ((size_t)1 << 62)

void imp__walks_theta_get(const struct imp_scene *scene, double *theta)
{
    for (size_t k = 0; k < scene->n_params; k++)
        for (size_t e = 0; e < scene->params[k].info.count; e++)
            theta[scene->params[k].info.offset + e] =
                imp__param_get(&scene->params[k], e);
}

void imp__walks_theta_set(struct imp_scene *scene, const double *theta)
{
    for (size_t k = 0; k < scene->n_params; k++) {
        struct imp_param *p = &scene->params[k];
        for (size_t e = 0; imp__walks_is_number(p) && e < p->info.count; e++)
            imp__param_set(p, e, theta[p->info.offset + e]);
    }
    imp__theta_announce(scene);
}

struct reading {
    struct imp_record_source from;
    uint64_t size; /* of the file */
    struct imp_walks_head head;
    imp_scene *held; /* that the file holds */
    double *theta;   /* [n_theta] of the draw */
};

static enum imp_status damaged(const struct reading *r, const char *what)
{
    return imp__error(r->from.ctx, IMP_E_IO, "%s: damaged file of recorded walks (%s)",
                      r->from.path, what);
}

static enum imp_status take(struct reading *r, void *out, size_t n)
{
    if (fread(out, 1, n, r->from.f) != n)
        return ferror(r->from.f) ? imp__error(r->from.ctx, IMP_E_IO, "%s: %s",
                                              r->from.path, strerror(errno))
                                 : damaged(r, "it ends early");
    r->from.sum = imp__hash(r->from.sum, out, n);
    return IMP_OK;
}

static enum imp_status head_take(struct reading *r)
{
    imp_context *ctx = r->from.ctx;
    struct imp_walks_head *h = &r->head;
    const char *path = r->from.path;
    enum imp_status st = IMP_OK;
    if (fseeko(r->from.f, 0, SEEK_END) != 0 || ftello(r->from.f) < 0)
        IMP_TRY(imp__error(ctx, IMP_E_IO, "%s: %s", path, strerror(errno)));
    r->size = (uint64_t)ftello(r->from.f);
    rewind(r->from.f);
    if (r->size < sizeof *h)
        IMP_TRY(imp__error(ctx, IMP_E_SCENE, "%s: not a file of recorded walks", path));
    IMP_TRY(take(r, h, sizeof *h));
    if (memcmp(h->magic, IMP_WALKS_MAGIC, sizeof h->magic) != 0)
        IMP_TRY(imp__error(ctx, IMP_E_SCENE, "%s: not a file of recorded walks", path));
    if (h->byte_order != IMP_WALKS_BYTE_ORDER)
        IMP_TRY(
            imp__error(ctx, IMP_E_SCENE,
                       "%s: recorded walks of byte order %08x; this machine's is %08x",
                       path, h->byte_order, IMP_WALKS_BYTE_ORDER));
    if (h->version != IMP_WALKS_VERSION)
        IMP_TRY(
            imp__error(ctx, IMP_E_SCENE,
                       "%s: recorded walks of version %u; this program reads version %d",
                       path, h->version, IMP_WALKS_VERSION));
    if (h->spp < 0 || h->points < IMP_POINTS_INDEPENDENT ||
        h->points > IMP_POINTS_SOBOL || h->wavelengths < 0 ||
        h->wavelengths > IMP_WAVELENGTHS_IMPORTANCE || h->wavelength_set < 0 ||
        h->losses < 0 || h->losses > 1 || h->n_stores < 1 || h->guided < 0 ||
        h->guided > 1 || h->reserved != 0 || !(h->survival >= 0 && h->survival <= 1) ||
        !(h->ess >= 0 && h->ess <= 1) ||
        !(h->headroom >= 0 && h->headroom <= IMP_HEADROOM_MOST) ||
        h->n_theta > SIZE_MAX / 16)
        IMP_TRY(damaged(r, "its head"));
    if (h->scene_bytes > r->size) IMP_TRY(damaged(r, "it ends early"));
out:
    return st;
}

/* The scene that the file holds, at the numbers of the draw. */
static enum imp_status scene_take(struct reading *r)
{
    enum imp_status st = IMP_OK;
    imp_context *ctx = r->from.ctx;
    const size_t bytes = (size_t)r->head.scene_bytes;
    unsigned char *data = imp__alloc_raw(ctx, bytes + 1, 1);
    uint64_t sum, end;
    if (!data)
        return imp__error(ctx, IMP_E_NOMEM, "%s: no memory for a scene", r->from.path);
    IMP_TRY(take(r, data, bytes));
    IMP_TRY(imp__tree_take(ctx, r->from.path, data, bytes, &r->held));
    if (r->held->n_theta != r->head.n_theta) IMP_TRY(damaged(r, "its parameters"));
    r->theta = imp__alloc(ctx, r->held->n_theta + 1, sizeof *r->theta);
    if (!r->theta)
        IMP_TRY(imp__error(ctx, IMP_E_NOMEM, "%s: no memory for numbers", r->from.path));
    for (size_t k = 0; k < r->held->n_params; k++) {
        const struct imp_param *p = &r->held->params[k];
        double *at = r->theta + p->info.offset;
        if (!imp__walks_is_number(p)) continue;
        IMP_TRY(take(r, at, p->info.count * sizeof *at));
        for (size_t e = 0; e < p->info.count; e++)
            if (!isfinite(at[e])) IMP_TRY(damaged(r, "a number is not finite"));
    }
    sum = r->from.sum;
    IMP_TRY(take(r, &end, sizeof end));
    if (end != sum) IMP_TRY(damaged(r, "checksum of its scene"));
    imp__walks_theta_set(r->held, r->theta);
    imp__walks_theta_get(r->held, r->theta);
    if (imp__fingerprint_evaluated(r->held) != r->head.evaluated)
        IMP_TRY(imp__error(ctx, IMP_E_SCENE,
                           "%s: damaged, or written by another build: its materials and "
                           "lights are not those that it was written with",
                           r->from.path));
out:
    imp__release(ctx, data);
    return st;
}

/* Are these the walks of a given scene? The records are checked tile by tile as well. */
static enum imp_status scene_same(const struct reading *r, const struct imp_scene *scene)
{
    if (scene->n_theta == r->head.n_theta &&
        imp__fingerprint_evaluated(scene) == r->head.evaluated)
        return IMP_OK;
    return imp__error(r->from.ctx, IMP_E_ARG,
                      "%s: walks of another scene: its materials, lights or parameters "
                      "differ (%llu numbers there, %zu here)",
                      r->from.path, (unsigned long long)r->head.n_theta, scene->n_theta);
}

/* A walk has its bytes in the file: what is not there takes no memory. */
static bool has_room(const struct reading *r, const struct imp_sensor *sensor)
{
    const int spp = r->head.spp > 0 ? r->head.spp : sensor->spp;
    return (double)sensor->film.crop_w * sensor->film.crop_h * spp *
               (double)sizeof(struct imp_record_walk) <=
           (double)r->size;
}

static enum imp_status stores_take(struct reading *r, struct imp_walks *w, size_t memory)
{
    enum imp_status st = IMP_OK;
    int last = -1;
    const bool own = w->scene == r->held;
    for (int k = 0; k < r->head.n_stores; k++) {
        struct imp_walks_store_head h;
        struct imp_tracer tracer;
        IMP_TRY(take(r, &h, sizeof h));
        if (h.index <= last || h.index >= w->scene->n_sensors || h.roulette < 0 ||
            h.roulette > 1 || !has_room(r, w->scene->sensors[h.index]))
            IMP_TRY(damaged(r, "its sensors"));
        last = h.index;
        IMP_TRY(
            imp__walks_sensor(w, NULL, h.index, imp_min(memory, BUDGET_MOST), &tracer));
        struct imp_store *s = &w->stores[k];
        atomic_store(&s->roulette, h.roulette != 0);
        s->left = r->head.n_stores - k;
        IMP_TRY(imp__store_take(&r->from, s, &tracer, own ? &h.of : NULL));
        const size_t taken = s->bytes + s->reduced_bytes;
        memory -= imp_min(memory, taken);
    }
    if (fgetc(r->from.f) != EOF) IMP_TRY(damaged(r, "it goes on behind its end"));
out:
    return st;
}

/* Walks are reduced with the numbers that may not change as they are in the scene: not
 * where these are others than when the walks were drawn, which is an error later on. */
static enum imp_status reduction_check(struct imp_walks *w)
{
    uint8_t *changed = imp__alloc(w->ctx, w->scene->n_params + 1, 1);
    if (!changed) return imp__error(w->ctx, IMP_E_NOMEM, "no memory for recorded walks");
    if (imp__walks_changed(w, changed) != IMP_OK) {
        imp__reduction_destroy(w->reduction);
        w->reduction = NULL;
    }
    imp__release(w->ctx, changed);
    return IMP_OK;
}

/* `scene`: NULL, or whose walks these have to be. */
static enum imp_status walks_take(struct reading *r, imp_scene *scene, size_t memory,
                                  double ess, imp_walks **out)
{
    enum imp_status st = IMP_OK;
    imp_walks *w = NULL;
    struct imp_run run = IMP_RUN_INIT;
    IMP_TRY(head_take(r));
    IMP_TRY(scene_take(r));
    if (scene) IMP_TRY(scene_same(r, scene));
    else scene = r->held;
    run.seed = r->head.seed;
    run.spp = r->head.spp;
    run.from = IMP_FROM_SENSOR; /* whatever the integrator is: others are not recorded */
    run.points = (enum imp_points)r->head.points;
    run.wavelengths = (enum imp_wavelength_sampling)r->head.wavelengths;
    run.wavelength_set = r->head.wavelength_set;
    const struct imp_walks_options o = {.size = sizeof o,
                                        .losses = r->head.losses,
                                        .survival =
                                            r->head.survival > 0 ? r->head.survival : -1,
                                        .ess = ess > 0 ? ess : r->head.ess,
                                        .headroom = r->head.headroom};
    IMP_TRY(imp__walks_begin(scene, &run, &o, NULL, &w));
    w->guided = r->head.guided != 0;
    memcpy(w->theta, r->theta, scene->n_theta * sizeof *w->theta);
    IMP_TRY(reduction_check(w));
    IMP_TRY(stores_take(r, w, memory));
    w->owns_scene = scene == r->held;
    for (size_t k = 0; k < scene->n_params && w->owns_scene; k++) {
        struct imp_param_info *info = &scene->params[k].info;
        if (w->chosen[k]) continue;
        if (info->flags & IMP_PARAM_DIFFERENTIABLE && scene->params[k].probed)
            info->why = "collisions of the walks were drawn by it";
        info->flags &= ~(unsigned)IMP_PARAM_DIFFERENTIABLE;
    }
    if (w->owns_scene) r->held = NULL;
    *out = w;
    w = NULL;
out:
    imp__walks_destroy(w);
    return st;
}

enum imp_status imp_walks_read(imp_context *ctx, imp_scene *scene, const char *path,
                               const struct imp_walks_options *options, imp_walks **out)
{
    IMP_REQUIRE(NULL, ctx, "context");
    IMP_REQUIRE(ctx, path, "path");
    IMP_REQUIRE(ctx, out, "out");
    struct imp_walks_options o = IMP_WALKS_OPTIONS_INIT;
    IMP_OPTIONS(ctx, o, options, "options");
    IMP_FLOAT_MODE;
    enum imp_status st = IMP_OK;
    struct imp_bytes held = {0};
    struct reading r = {.from = {.ctx = ctx, .path = path}};
    if (scene && (scene->ctx != ctx || !scene->committed))
        return imp__error(ctx, IMP_E_ARG,
                          "the scene has not been committed, or is another context's");
    if (!(o.ess >= 0 && o.ess <= 1))
        return imp__error(ctx, IMP_E_ARG, "options: ess %g is out of range", o.ess);
    if (o.survival != 0 || o.headroom != 0)
        return imp__error(ctx, IMP_E_ARG,
                          "options: the file has its own survival and headroom, not %g "
                          "and %g",
                          o.survival, o.headroom);
    IMP_TRY(imp__file_open(ctx, path, &held, &r.from.f));
    if (!r.from.f) IMP_TRY(imp__error(ctx, IMP_E_IO, "%s: there is no such file", path));
    if (scene) {
        IMP_READS(scene);
        IMP_TRY(walks_take(&r, scene, o.memory > 0 ? o.memory : MEMORY, o.ess, out));
    } else {
        IMP_TRY(walks_take(&r, NULL, o.memory > 0 ? o.memory : MEMORY, o.ess, out));
    }
out:
    if (r.from.f) fclose(r.from.f);
    imp__bytes_free(ctx, &held);
    imp_scene_destroy(r.held);
    imp__release(ctx, r.theta);
    return st;
}
