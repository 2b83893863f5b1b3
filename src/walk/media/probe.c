/* SPDX-License-Identifier: Apache-2.0
 *
 * Probes of an extinction, drawn and evaluated (probe.h). */
#include "probe.h"

/* So many walks follow their probe, which costs about as much as the walk. On a plume
 * all would give 1.3 to 1.4 times less variance at equal time, and a gradient would take
 * 3.4 times the time of a picture in place of 2.4. */
#define FOLLOWED 0.5

void imp__probe_begin(const struct imp_walk *walk, struct imp_probing *p)
{
    const double u = imp__u01(imp__key_branch(walk->key, 0, 0x5ee4), 0);
    *p = (struct imp_probing){.followed = u < FOLLOWED};
}

/* At distance t, `from` times the events behind `first`, which lie before it. */
static struct imp_flown flown_to(const struct imp_step *s, const struct imp_medium *m,
                                 const struct imp_track *track, int first,
                                 struct imp_flown from, double near, double t)
{
    const struct imp_carried *carried = s->at.carried;
    const double least = imp__real_least(s->tracer->headroom);
    imp_spec f = imp__spec(1), p = f, in[IMP_INPUTS_MAX];
    if (!m->majorants)
        f = p = imp__attenuation(
            imp__extinction_at(m, imp__decided_v3(track->o), carried, in), t - near);
    for (int i = first; m->majorants && i < track->n && track->event[i].t < t; i++) {
        const struct imp_event *e = &track->event[i];
        const imp_v3 at =
            imp__decided_v3(track->o) + imp__decided_v3(track->d) * (double)e->t;
        const imp_spec null =
            1 - imp__extinction_at(m, at, carried, in) * (1 / (double)e->bound);
        f *= null;
        p *= imp__lesser(null, imp__spec(1 - least));
    }
    return (struct imp_flown){from.value * f, from.density * p};
}

/* Where a stretch is probed: at s on [near, far], with 1/p(s); `length`: what it counts in
 * the choice among stretches, l where s is uniform. */
struct place {
    double s, length, over_p;
};

static struct place uniform_place(double near, double far, double u)
{
    return (struct place){near + (far - near) * u, far - near, far - near};
}

static struct place open_place(const struct imp_step *s, double near, double far,
                               double u)
{
    const struct imp_ball *ball = &s->scene->ball;
    const imp_v3 to = ball->centre - s->o;
    const double s0 = imp__dot(to, s->d) + s->flight.base,
                 h = imp__length(to - s->d * imp__dot(to, s->d)) + ball->radius,
                 a = atan((near - s0) / h),
                 b = isfinite(far) ? atan((far - s0) / h) : M_PI_2,
                 x = h * tan(a + (b - a) * u);
    return (struct place){.s = imp_clamp(s0 + x, near, far),
                          .length = ball->radius * ball->radius / h * (b - a),
                          .over_p = (b - a) * (h * h + x * x) / h};
}

bool imp__probe_diverges(const struct imp_step *s, const struct imp_medium *m)
{
    const struct imp_texcoord at = {.p = s->o, .carried = s->at.carried};
    imp_spec in[IMP_INPUTS_MAX];
    struct imp_coefficients c;
    imp__inputs_eval(m->input, m->n_own, &at, in);
    m->ops->eval(m, in, &c);
    return s->scene->environment >= 0 || !imp__is_zero_used(c.emission, s->at.carried);
}

void imp__probe_offer(struct imp_step *s, const struct imp_medium *m,
                      const struct imp_track *track, int first, struct imp_flown before,
                      double near, double far, bool open)
{
    struct imp_probing *p = s->probing;
    struct imp_vertex *from = s->walk->last;
    const struct imp_key key = imp__key_branch(s->walk->key, (int)p->n++, 0x9e0be);
    const double u = imp__u01(key, 1);
    const struct place at =
        imp_likely(!open) ? uniform_place(near, far, u) : open_place(s, near, far, u);
    const double t = at.s, weight = at.length * imp__max_used(s->beta, s->at.carried);
    if (!(weight > 0)) return;
    if (!isfinite(weight)) {
        s->walk->dropped = IMP_DROP_INFINITE;
        return;
    }
    if (!p->followed) return;
    p->total += weight;
    if (!(imp__u01(key, 0) * p->total < weight)) return;

    if (!p->state) p->state = imp__arena_take(s->arena, 1, sizeof *p->state);
    if (!p->probe) p->probe = imp__arena_take(s->arena, 1, sizeof *p->probe);
    if (!p->state || !p->probe) {
        s->walk->dropped = IMP_DROP_MEMORY;
        return;
    }
    const struct imp_flown f = flown_to(s, m, track, first, before, near, t);
    *p->state = *s;
    const imp_spec pass = f.value * imp__lane_mis_decide(p->state, f.density);
    p->state->beta *= pass;
    p->state->flight.here = p->state->flight.medium = m;
    p->state->flight.nest_here = s->flight.nest;
    p->weight = weight;
    p->from = from;
    *p->probe = (struct imp_probe){
        .medium = m,
        .at = {.p = s->o + s->d * (t - s->flight.base), .carried = s->at.carried},
        .reach = from->w * pass,
        .length = at.over_p};
}

void imp__probe_follow(struct imp_step *s)
{
    struct imp_probing *p = s->probing;
    if (!p || !p->probe || s->walk->dropped) return;
    const int max_depth = s->tracer->integrator->max_depth;
    struct imp_probe *probe = p->probe;
    struct imp_step *side = p->state;
    struct imp_tracer tracer = *s->tracer;
    struct imp_walk walk = {.key = imp__key_branch(s->walk->key, side->depth, 0x51de),
                            .time = s->walk->time};
    imp_spec scratch[IMP_INPUTS_MAX];
    probe->length *= p->total / (p->weight * FOLLOWED);
    probe->emits = max_depth < 0 || imp__bounces(side) < max_depth;
    p->from->probe = probe;
    s->walk->valid = true; /* although nothing may have scattered it */
    tracer.active = NULL;
    tracer.value_only = true;
    side->tracer = &tracer;
    side->walk = &walk;
    side->recorded = false;
    side->probing = NULL;
    side->scratch = scratch;
    const struct imp_arena_mark mark = imp__arena_mark(s->arena);
    probe->scattered = p->scattered(side, probe->medium->pure, probe->at.p);
    imp__arena_rewind(s->arena, mark);
    s->walk->dropped = walk.dropped;
}

void imp__probe_d(const struct imp_tracer *tracer, const struct imp_vertex *v,
                  imp_spec *d)
{
    const struct imp_probe *p = v->probe;
    const struct imp_medium *m = p->medium;
    const imp_spec lost = v->w * v->beyond;
    imp_spec in[IMP_INPUTS_MAX];
    struct imp_coefficients c, dc[IMP_INPUTS_MAX];
    imp__seen_inputs(tracer, m, &p->at, in);
    m->ops->eval(m, in, &c);
    m->ops->eval_d(m, in, dc);
    if (!p->emits) c.emission = (imp_spec){0};
    for (int j = 0; j < m->n_own; j++) {
        const imp_spec absorbing = dc[j].extinction - dc[j].scattering;
        d[j] = (imp_spec){0};
        if (m->ops->inputs[j].flags & IMP_INPUT_EXTINCTION)
            d[j] =
                (p->reach * (dc[j].scattering * p->scattered + absorbing * c.emission) -
                 dc[j].extinction * lost) *
                p->length;
    }
}
