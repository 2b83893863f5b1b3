/* SPDX-License-Identifier: Apache-2.0
 *
 * The schedule: links between whole polygons first, then refinement under a falling
 * tolerance with a few warm-started sweeps each, until the results hardly change
 * (measurements; the picture, as the paper has it, where one is wanted), the tolerance
 * has reached its end, or a budget is spent. */
#include "base/team.h"
#include "color/rgb.h"
#include "elements.h"
#include <stdio.h>
#include <string.h>

static void tick(imp_elements *e, const char *stage, double fraction, const char *note)
{
    const double now = imp__now();
    if (e->deadline_s > 0 && now > e->deadline_s && !e->stop) {
        e->stop = true;
        e->reason = "time limit";
    }
    if (!e->opt.progress) return;
    if (fraction >= 0) e->fraction = fraction;
    if (now - e->last_tick_s < 0.1 && fraction < 1) return;
    e->last_tick_s = now;
    const double elapsed = now - e->start_s;
    const struct imp_progress p = {.size = sizeof p,
                                   .stage = stage,
                                   .fraction = e->fraction,
                                   .elapsed_s = elapsed,
                                   .eta_s = -1,
                                   .rate = elapsed > 0 ? (double)e->n_links / elapsed : 0,
                                   .rate_unit = "links",
                                   .note = note};
    if (e->opt.progress(&p, e->opt.progress_payload) && !e->stop) {
        e->stop = true;
        e->reason = "stopped by the caller";
    }
}

void imp__el_tick(imp_elements *e, const char *stage, double fraction, const char *note)
{
    bool any;
    tick(e, stage, fraction, note);
    /* Clocks and users differ between ranks. */
    if (imp__team_any(e->ctx, e->stop, &any) != IMP_OK) any = true;
    if (any && !e->stop) e->reason = "stopped by another rank";
    e->stop = any;
}

enum imp_status imp__el_create(const imp_scene *scene,
                               const struct imp_elements_options *options, bool quiet,
                               imp_elements **out)
{
    enum imp_status st = IMP_OK;
    IMP_FLOAT_MODE;
    IMP_READS(scene);
    if (!scene->committed)
        return imp__error(scene->ctx, IMP_E_ARG, "the scene is not committed");
    imp_elements *e = imp__alloc(scene->ctx, 1, sizeof *e);
    if (!e)
        return imp__error(scene->ctx, IMP_E_NOMEM, "out of memory for finite elements");
    e->ctx = scene->ctx;
    imp__context_hold(e->ctx);
    e->scene = scene;
    e->ch = scene->channels;
    e->reason = "not solved";
    e->quiet = quiet;
    imp__arena_init(&e->arena, e->ctx);
    if (e->ch == 1) e->lum[0] = 1;
    else e->lum[0] = IMP_LUM_R, e->lum[1] = IMP_LUM_G, e->lum[2] = IMP_LUM_B;
    for (int c = 0; c < e->ch; c++) e->eye[c] = 1.0 / e->ch;
    for (int i = 0; i < 3; i++) e->size = fmax(e->size, scene->hi[i] - scene->lo[i]);
    IMP_TRY(imp__el_options(e, options));
    IMP_TRY(imp__el_roots(e));
    IMP_TRY(imp__el_materials(e));
    for (size_t i = 0; i < e->n_roots; i++) IMP_TRY(imp__el_element_root(e, (uint32_t)i));
    *out = e;
    e = NULL;
out:
    imp_elements_destroy(e);
    return st;
}

enum imp_status imp_elements_create(const imp_scene *scene,
                                    const struct imp_elements_options *options,
                                    imp_elements **out)
{
    IMP_REQUIRE(NULL, scene, "scene");
    IMP_REQUIRE(scene->ctx, out, "out");
    if (scene->rayless)
        return imp__error(scene->ctx, IMP_E_UNSUPPORTED,
                          "a scene from a file of recorded walks has no geometry, and no "
                          "finite elements");
    return imp__el_create(scene, options, false, out);
}

void imp_elements_destroy(imp_elements *e)
{
    if (!e) return;
    imp_context *ctx = e->ctx;
    void *const all[] = {e->roots, e->elements,   e->l,         e->g,     e->c,
                         e->b,     e->from_above, e->a,         e->links, e->in_start,
                         e->out,   e->value,      e->out_start, e->hits,  e->seen,
                         e->log,   e->picture,    e->rows};
    for (size_t k = 0; k < imp_count(all); k++) imp__release(e->ctx, all[k]);
    imp__arena_free(&e->arena);
    imp__release(ctx, e);
    imp__context_drop(ctx);
}

/* ---- Solving ------------------------------------------------------------------- */

static size_t leaves_of(const imp_elements *e)
{
    size_t n = 0;
    for (size_t k = 0; k < e->n_elements; k++) n += e->elements[k].child == 0;
    return n;
}

static enum imp_status log_add(imp_elements *e)
{
    enum imp_status st = IMP_OK;
    struct imp_elements_step s = {.size = sizeof s,
                                  .eps = e->eps,
                                  .links = e->n_links,
                                  .elements = e->n_elements,
                                  .leaves = leaves_of(e),
                                  .rays = e->rays,
                                  .measure = imp__el_measure(e, NULL),
                                  .elapsed_s = imp__now() - e->start_s};
    if (!isfinite(s.measure))
        return imp__error(e->ctx, IMP_E_NUMERIC,
                          "reflections grow without end: the surfaces "
                          "give back more than arrives");
    IMP_TRY(imp__el_look(e, &s.change));
    struct imp_elements_step *grown =
        imp__grow(e->ctx, e->log, &e->cap_log, e->n_log + 1, sizeof *grown);
    if (!grown) IMP_TRY(imp__error(e->ctx, IMP_E_NOMEM, "out of memory for the log"));
    e->log = grown;
    e->log[e->n_log++] = s;
out:
    return st;
}

/* Sum over leaves of area x |constant coefficient|, to see whether sweeps still move it.
 */
static double weight_of(const imp_elements *e, bool importance)
{
    double sum = 0;
    for (size_t k = 0; k < e->n_roots; k++) {
        const struct imp__element *x = &e->elements[e->roots[k].element];
        const int n = imp__el_n(e, &e->roots[k]);
        for (int c = 0; c < e->ch && n; c++)
            sum += x->area * fabs(imp__el_at(e, importance ? e->g : e->l, x)[c * n]);
    }
    return sum;
}

enum imp_status imp__el_settle(imp_elements *e, int n, bool importance, double tolerance)
{
    enum imp_status st = IMP_OK;
    double before[2] = {weight_of(e, false), weight_of(e, true)};
    const int most = 200;
    for (int k = 0; k < most; k++) {
        IMP_TRY(imp__el_sweep(e, n, importance, false));
        const double now[2] = {weight_of(e, false), importance ? weight_of(e, true) : 0};
        if (!isfinite(now[0]) || !isfinite(now[1]) ||
            (k > 20 && now[0] > 1e3 * before[0]))
            IMP_TRY(imp__error(e->ctx, IMP_E_NUMERIC,
                               "reflections grow without end: the surfaces "
                               "give back more than arrives"));
        if (fabs(now[0] - before[0]) <= tolerance * now[0] &&
            (!importance || fabs(now[1] - before[1]) <= tolerance * now[1]))
            return IMP_OK;
        before[0] = now[0];
        before[1] = now[1];
        imp__el_tick(e, "settle", -1, NULL);
        if (e->stop) return IMP_OK;
    }
    imp__warn(e->ctx, "finite elements: reflections had not died away after %d sweeps",
              most * n);
out:
    return st;
}

enum imp_status imp_elements_solve(imp_elements *e)
{
    enum imp_status st = IMP_OK;
    IMP_REQUIRE(NULL, e, "elements");
    IMP_FLOAT_MODE;
    IMP_READS(e->scene);
    const bool importance = !e->opt.no_importance;
    bool full = false;
    int still = 0;
    e->start_s = imp__now();
    e->deadline_s = e->opt.time_limit_s > 0 ? e->start_s + e->opt.time_limit_s : 0;
    e->stop = false;
    e->reason = "the smallest tolerance was reached";
    if (!e->n_links) IMP_TRY(imp__el_links_first(e));
    else if (!e->sorted) IMP_TRY(imp__el_links_sort(e, NULL, e->n_links));
    if (!e->seen) IMP_TRY(imp__el_sources(e));
    e->solved = false; /* a failure leaves fields half made */
    IMP_TRY(imp__el_bin(e));
    /* From zero, also where there is an older solution: of lamps that went out its light
     * would remain, die away only sweep by sweep, and be refined all the way down. */
    IMP_TRY(imp__el_sweep(e, e->opt.sweeps + 2, importance, true));
    e->n_log = 0;
    IMP_TRY(log_add(e));
    const double first = e->opt.eps_first, last = e->opt.eps_last;
    for (double rel = first; rel >= last && !e->stop; rel /= 2) {
        char note[96];
        e->eps = rel * imp__el_total(e, importance);
        if (!(e->eps > 0)) {
            e->reason = "no light reaches the measurement";
            if (e->n_log > 1 || importance) break;
        }
        const size_t before = e->n_links;
        IMP_TRY(imp__el_refine(e, importance, &full));
        IMP_TRY(imp__el_bin(e));
        IMP_TRY(imp__el_sweep(e, e->opt.sweeps, importance, false));
        IMP_TRY(log_add(e));
        const struct imp_elements_step *s = &e->log[e->n_log - 1];
        snprintf(note, sizeof note, "%zu links, measure %.6g, change %.3g %%", s->links,
                 s->measure, 100 * s->change);
        imp__el_tick(e, "solve", log(rel / first) / log(last / first), note);
        if (e->stop) break;
        if (full) {
            e->reason = "the budget of links or memory is spent";
            break;
        }
        /* Twice in a row; a step that refined nothing does not count. */
        if (s->links > before + before / 8)
            still = s->change < e->opt.stop ? still + 1 : 0;
        if (still == 2) {
            e->reason = e->opt.n_sources ? "the measurements no longer change"
                                         : "the picture no longer changes";
            break;
        }
    }
    const bool stopped = e->stop;
    e->stop = false;
    e->deadline_s = 0;
    e->solved = true;
    e->has_importance = importance;
    IMP_TRY(imp__el_settle(e, imp_max(e->opt.final_sweeps / 3, 1), importance, 1e-7));
    IMP_TRY(log_add(e));
    if (stopped || e->stop) {
        imp__error(e->ctx, IMP_CANCELLED, "stopped: %s", e->reason);
        return IMP_CANCELLED;
    }
out:
    return st;
}

enum imp_status imp__el_parameters(imp_elements *e)
{
    for (size_t i = 0; i < e->n_roots; i++) {
        struct imp__el_root *r = &e->roots[i];
        if (r->light == EL_DARK || r->light_param < 0) continue;
        for (int c = 0; c < 3; c++)
            r->radiance[c] = r->light_value[c] = imp__param_get(
                &e->scene->params[r->light_param], r->light_count == 3 ? (size_t)c : 0);
        if (r->power_input) r->power = r->power_input->value[0];
    }
    for (int i = 0; i < e->n_materials; i++) {
        struct imp__el_material *m = &e->materials[i];
        struct imp__el_material fresh = *m;
        if (!m->bsdf) continue;
        const enum imp_status st =
            imp__el_project(e->ctx, &e->arena, &e->basis, e->ch, "", &fresh);
        if (st != IMP_OK) return st;
        if (fresh.n > m->n)
            return imp__error(e->ctx, IMP_E_UNSUPPORTED,
                              "a material has changed its kind: "
                              "it needs new elements");
        fresh.n = m->n;
        *m = fresh;
    }
    return IMP_OK;
}

enum imp_status imp_elements_update(imp_elements *e)
{
    enum imp_status st = IMP_OK;
    IMP_REQUIRE(NULL, e, "elements");
    if (!e->solved)
        return imp__error(e->ctx, IMP_E_ARG, "the elements are not solved yet");
    IMP_FLOAT_MODE;
    IMP_READS(e->scene);
    IMP_TRY(imp__el_parameters(e));
    IMP_TRY(imp__el_bin(e));
    IMP_TRY(imp__el_settle(e, 4, e->has_importance, 1e-10));
    IMP_TRY(imp__el_measure_each(e, e->each));
out:
    return st;
}

enum imp_status imp_elements_get_info(const imp_elements *e,
                                      struct imp_elements_info *info)
{
    IMP_REQUIRE(NULL, e, "elements");
    IMP_REQUIRE(e->ctx, info, "info");
    IMP_SIZED(e->ctx, info, "info");
    IMP_FLOAT_MODE;
    struct imp_elements_info i = {.size = sizeof i,
                                  .order = e->basis.order,
                                  .functions = e->basis.n,
                                  .polygons = e->n_roots,
                                  .elements = e->n_elements,
                                  .leaves = leaves_of(e),
                                  .links = e->n_links,
                                  .skipped = e->skipped,
                                  .rays = e->rays,
                                  .bytes = imp__el_bytes(e),
                                  .reason = e->reason,
                                  .n_steps = e->n_log,
                                  .steps = e->log};
    i.bytes_per_link = (double)(sizeof *e->links + 4 * (size_t)e->ch * sizeof *e->value +
                                sizeof *e->out);
    i.bytes_per_element =
        (double)(sizeof *e->elements + 2 * sizeof *e->in_start) +
        (e->n_elements ? 8.0 * (5 * e->ch + 1) * (double)e->n_coef / (double)e->n_elements
                       : 0);
    for (int k = 0; k < e->n_materials; k++)
        i.worst_residual = fmax(i.worst_residual, e->materials[k].residual);
    if (e->solved) {
        i.measure = imp__el_measure(e, &i.measure_direct);
        i.measure_adjoint = e->has_importance ? imp__el_measure_adjoint(e) : NAN;
        i.luminance = imp__el_luminance(e);
        i.n_measures = e->n_sources;
        i.measures = e->each;
    }
    IMP_GIVE(e->ctx, info, i, "info");
    return IMP_OK;
}
