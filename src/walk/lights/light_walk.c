/* SPDX-License-Identifier: Apache-2.0
 *
 * One walk from a light is decided (light_walk.h), from its start on. */
#include "kind/bsdf/transport.h"
#include "walk/both/both.h"
#include <float.h>

/* In place of a pixel in the key: no pixel of a film has this number. */
#define LIGHT_WALKS UINT64_C(0x4c69676874000000)

/* ---- One step --------------------------------------------------------------------- */

/* Draw where the light goes. False: nowhere. */
static bool direction_draw(const struct imp_step *s, const struct imp_bsdf *b,
                           const struct imp_frame *frame, double u[3],
                           struct imp_dirs *dirs)
{
    if (imp_unlikely(s->guided.here) && imp__guided_light_draw(s, frame, u, dirs))
        return true;
    if (imp_likely(!b->shaped)) return imp__bsdf_transposed_sample(b, s->in, u, dirs);
    imp_spec own[IMP_INPUTS_MAX];
    imp__shaped_inputs(b, s->in, imp__waves_drew(s->at.carried), own);
    return imp__bsdf_transposed_sample(b, own, u, dirs);
}

/* Its density, in all lanes together where they differ; 0: the walk ends. d: the direction in
 * the world. *kernel: without a guide. */
static double direction_pdf(struct imp_step *s, const struct imp_bsdf *b,
                            const struct imp_dirs *dirs, imp_v3 d, double *kernel)
{
    if (imp_likely(!b->shaped)) {
        *kernel = imp__bsdf_transposed_pdf(b, s->in, dirs);
        return imp_unlikely(s->guided.here) ? imp__guided_light_pdf(s, *kernel, d)
                                            : *kernel;
    }
    const struct imp_dirs exchanged = {dirs->wi, dirs->wo, dirs->lobe, dirs->derivative};
    imp_spec p;
    imp__shaped_pdf(b, s->at.carried, s->in, &exchanged, &p);
    if (!(p[imp__lane_mis_drew(s)] > 0)) return 0;
    return *kernel = 1 / imp__lane_mis_decide(s, p);
}

/* Whether the walk goes on, and where. */
static bool scatter(struct imp_light_step *w, struct imp_vertex *v,
                    const struct imp_surface *at, const struct imp_frame *frame,
                    bool bounces)
{
    struct imp_step *s = &w->s;
    const struct imp_walk_integrator *integrator = s->tracer->integrator;
    const struct imp_bsdf *b = v->bsdf;
    const struct imp_key key = s->walk->key;

    /* Draw a direction. */
    double u[3] = {imp__u01(key, imp__dim(s->depth, IMP_DIM_LOBE)),
                   imp__u01(key, imp__dim(s->depth, IMP_DIM_DIR_U)),
                   imp__u01(key, imp__dim(s->depth, IMP_DIM_DIR_V))};
    struct imp_dirs dirs = {.wi = s->wo_drawn,
                            .lobe = IMP_SMOOTH,
                            .derivative = imp__derivative_wanted(s, b)};
    if (!direction_draw(s, b, frame, u, &dirs)) return false;
    const bool straight = imp_unlikely(b->straight) && s->segment->through &&
                          dirs.lobe >= 0 && dirs.lobe < 64 &&
                          b->straight >> dirs.lobe & 1;
    if (!straight && !bounces) return false;
    const imp_v3 d = imp__to_world(frame, dirs.wo);
    dirs.wi = s->wo;
    dirs.wo = imp__decide(dirs.wo);

    /* The weight of the step: f c/p. */
    double kernel = 0;
    const double density = direction_pdf(s, b, &dirs, d, &kernel);
    const double c = v->shape ? imp__bsdf_exchange(b, s->in, &dirs, imp__dot(d, at->ng),
                                                   imp__dot(-s->d, at->ng))
                              : 1;
    if (!(density > 0) || !(c > 0)) return false;
    const double pdf = imp__decide1(density / c);
    imp_spec f;
    imp__bsdf_eval(b, s->at.carried, s->in, &dirs, &f);
    if (!(pdf > 0)) return false;
    /* Roulette goes by the weight without a guide: where that sends more walks, each is
     * worth no less for it. */
    const double drawn = imp_unlikely(s->guided.here && kernel > 0) ? kernel / c : pdf;
    if (!imp__throughput_add(s, b, f * (1 / drawn))) return false;

    /* Russian roulette. */
    double survive = 1;
    if (s->depth >= integrator->rr_depth) {
        survive = imp__decide1(fmin(imp__max_used(s->beta, s->at.carried), 0.95));
        if (!(imp__u01(key, imp__dim(s->depth, IMP_DIM_SURVIVE)) < survive)) return false;
        s->beta *= imp__spec(1 / survive);
    }
    imp__step_weigh(v, f, pdf, survive);
    if (s->recorded) {
        imp__store_v3(v->d.wo, dirs.wo);
        v->d.lobe = (int8_t)dirs.lobe;
        v->d.pdf = (imp_decided)pdf;
        v->d.survive = (imp_decided)survive;
        v->d.goes_on = true;
    }

    /* The ray in flight. */
    s->d = d;
    s->o = v->shape ? imp__offset(at->p, at->ng, d) : at->p;
    s->t_min = 0;
    s->t_max = INFINITY;
    if (s->segment->leave) s->segment->leave(s, v, at);
    if (imp_unlikely(straight)) { /* connections pass here: it goes on from before */
        s->straight++;
        w->passed += v->t;
        return true;
    }
    s->from = at->p;
    w->passed = 0;
    s->pdf = dirs.lobe == IMP_SMOOTH ? density : 0;
    w->pdf_across = 0;
    if (w->both) imp__both_light_leaves(w, b, &dirs);
    return true;
}

static bool step(struct imp_light_step *w)
{
    struct imp_step *s = &w->s;
    struct imp_hit hit;
    struct imp_surface at;
    struct imp_frame frame;

    /* Follow the ray to what it meets. */
    struct imp_vertex *v =
        imp__vertex_meet(s, s->segment->meet(s, &hit), &hit, &at, &frame);
    if (!v) return false;
    if (imp_unlikely(s->guided.guide != NULL)) imp__guided_light_arrive(s, v, &hit, &at);
    if (s->recorded) {
        v->d.from_light = true;
        v->d.met.weight = 0;
        imp__store_v3(v->d.wi, s->wo);
        imp__store_v3(v->d.wo, (imp_v3){0});
    }

    if (w->both && !imp__both_light_arrives(w, v, &at, &frame)) {
        s->walk->dropped = IMP_DROP_MEMORY;
        return false;
    }

    /* Light that reaches the sensor from here: it is met, or connected to. */
    if (v->shape && v->shape->sensor == s->tracer->sensor)
        imp__light_meet_sensor(w, v, &at);
    if (s->walk->dropped) return false;
    imp__light_connect_vertex(w, v, &at, &frame);
    if (s->walk->dropped || !s->tracer->integrator->directions) return false;

    /* The continuation. */
    const bool bounces =
        imp__light_depth_allows(s, s->depth + (s->tracer->sensor->shape ? 1 : 2));
    if (!bounces && !(imp_unlikely(v->bsdf->straight) && s->segment->through))
        return false;
    if (!scatter(w, v, &at, &frame, bounces)) return false;
    s->depth++;
    return !s->walk->dropped;
}

/* ---- Walks ------------------------------------------------------------------------ */

static void value_set(const struct imp_tracer *tracer, struct imp_walk *walk,
                      struct imp_reach *r, imp_spec values)
{
    imp_spec used = r->values = values;
    if (!tracer->wavelengths) used[3] = 0;
    if (imp_unlikely(!imp__is_within(used, FLT_MAX)))
        walk->dropped = imp__drop_cause(used);
    r->L = imp__walk_seen(walk, values);
}

void imp__light_walk_close(const struct imp_tracer *tracer, struct imp_light_walk *out)
{
    struct imp_walk *walk = &out->walk;
    imp_spec P = imp__spec(1);
    struct imp_reach *r = out->reach;
    for (struct imp_vertex *v = walk->first; v && r && !walk->dropped; v = v->next) {
        for (; r && r->vertex == v; r = r->next)
            value_set(tracer, walk, r, P * (r->met ? v->e : v->b));
        P *= v->w;
    }
    if (r && !r->vertex && !walk->dropped)
        value_set(tracer, walk, r, imp__walk_fold(&out->both->eye) * out->both->pixels);
    if (!walk->dropped) return;
    out->reach = NULL;
    out->n_reach = 0;
}

void imp__light_walk_follow(const struct imp_tracer *tracer, struct imp_arena *arena,
                            struct imp_light_walk *out)
{
    struct imp_walk *walk = &out->walk;
    imp_spec scratch[IMP_INPUTS_MAX];
    struct imp_light_step w;
    imp__step_begin(tracer, arena, walk, scratch, &w.s);
    w.out = out;
    w.end = &out->reach;
    w.pdf_across = w.passed = 0;
    w.both = out->both;
    if (out->both)
        w.s.lanes.drew = imp__lane_drawn(out->both->eye.key, imp__lane_mis_count(&w.s));
    if (imp__light_start(&w))
        while (step(&w)) {}
}

void imp__light_walk_trace(const struct imp_tracer *tracer, struct imp_arena *arena,
                           int64_t index, struct imp_light_walk *out)
{
    const struct imp_key key = imp__key(tracer->seed, LIGHT_WALKS, (uint64_t)index);
    struct imp_walk *walk = &out->walk;
    imp__light_walk_begin(tracer, walk, key);
    out->reach = NULL;
    out->n_reach = 0;
    out->both = NULL;
    out->arena = arena;
    if (tracer->integrator->both) {
        imp__both_trace(tracer, arena, index, out);
        return;
    }
    if (tracer->wavelengths &&
        !imp__walk_wave(tracer, arena, imp__wave_draw(tracer, walk, index), walk))
        return;
    imp__light_walk_follow(tracer, arena, out);
    imp__light_walk_close(tracer, out);
}
