/* SPDX-License-Identifier: Apache-2.0
 *
 * Reads the record after the fold (fold.c). Sweep: the adjoint, from the first vertex to the
 * last (reverse mode, not reverse order), and a piece of gradient falls off at every vertex.
 * Tangent: derivative and radiance together, from the last vertex to the first. Fold, sweep
 * and tangent differ only in the order in which the product rule is read; sweep and tangent
 * take the same pieces (vertex_pieces.h). */
#include "sweep.h"
#include "vertex_pieces.h"

/* ---- d radiance of an emitter / d its inputs ------------------------------------- */

/* If input j is a constant that shifts texture lookups, adds to d[j] the sum over textured
 * inputs k of d[k] (slope_k . d uv/d input j). */
static void lookup_d(const struct imp_emitter *e, const struct imp_active *active,
                     const struct imp_emission *x, const struct imp_texcoord *at,
                     imp_spec *d)
{
    for (int j = 0; j < e->n_in; j++) {
        const int param = e->input[j]->param;
        double duv[2];
        if (e->input[j]->texture || param < 0 || active->base[param] < 0) continue;
        e->ops->place_d(e, x, j, duv);
        for (int k = 0; k < e->n_in && (duv[0] != 0 || duv[1] != 0); k++) {
            const struct imp_texture *t = e->input[k]->texture;
            imp_spec slope[2];
            if (t && t->ops->slope && t->ops->slope(t, at, e->input[k]->scalar, slope))
                d[j] += d[k] * (slope[0] * duv[0] + slope[1] * duv[1]);
        }
    }
}

/* d [e->n_in], looked up at `at`, which is set. */
static inline void emitter_d(const struct imp_emitter *e, const struct imp_active *active,
                             const struct imp_emission *x, struct imp_texcoord *at,
                             imp_spec *d)
{
    imp_spec in[IMP_INPUTS_MAX];
    at->shape = e->shape; /* of a walk's light vertex, too */
    imp__emitter_place(e, x, at);
    imp__inputs_eval(e->input, e->n_in, at, in);
    if (imp_likely(!e->shaped)) e->ops->eval_d(e, in, x, d);
    else imp__shaped_light_d(e, at->carried, in, x, d);
    if (imp_unlikely(e->ops->place_d != NULL)) lookup_d(e, active, x, at, d);
}

/* ---- Reverse: pieces go to a sink ------------------------------------------------ */

struct reverse {
    struct imp_sweep to;
    imp_spec bar[IMP_INPUTS_MAX]; /* of the scatterer's inputs */
    bool any;
};

static inline __attribute__((always_inline)) void
emitter_scatter(const struct imp_tracer *tracer, int emitter, struct imp_emission *x,
                struct imp_texcoord *at, imp_spec bar, struct imp_sink *sink)
{
    const struct imp_emitter *e = tracer->scene->emitters[emitter];
    imp_spec d[IMP_INPUTS_MAX];
    emitter_d(e, tracer->active, x, at, d);
    for (int j = 0; j < e->n_in; j++) d[j] *= bar;
    imp__inputs_scatter(e->input, e->n_in, at, d, sink);
}
void imp__emitter_scatter(const struct imp_tracer *tracer, int emitter,
                          struct imp_emission *x, struct imp_texcoord *at, imp_spec bar,
                          struct imp_sink *sink)
{
    emitter_scatter(tracer, emitter, x, at, bar, sink);
}
void imp__sweep_emitter(const struct imp_sweep *s, struct imp_emitter_piece *p)
{
    const struct imp_emitter *e = s->tracer->scene->emitters[p->emitter];
    const imp_spec bar = p->adjoint * p->through[0] * p->through[1];
    imp_spec d[IMP_INPUTS_MAX];
    emitter_d(e, s->tracer->active, &p->x, &p->at, d);
    for (int j = 0; j < e->n_in; j++) d[j] *= bar;
    imp__sweep_inputs(s, e->input, e->n_in, &p->at, d);
}
static inline void reverse_emitter(void *taker, struct imp_emitter_piece *p)
{
    const struct reverse *r = taker;
    emitter_scatter(r->to.tracer, p->emitter, &p->x, &p->at,
                    p->adjoint * p->through[0] * p->through[1], r->to.sink);
}
static inline void both_emitter(void *taker, struct imp_emitter_piece *p)
{
    imp__sweep_emitter(&((struct reverse *)taker)->to, p);
}

static inline void vertex_scatter(const struct imp_tracer *tracer,
                                  const struct imp_vertex *v, const imp_spec *bar,
                                  struct imp_sink *sink)
{
    const struct imp_bsdf *b = v->bsdf;
    const struct imp_texcoord at = imp__vertex_at(v);
    if (imp_unlikely(v->d.scatterer == IMP_IN_MEDIUM))
        imp__point_scatter(tracer, v, &at, bar, sink);
    else imp__inputs_scatter(b->input, b->n_in, &at, bar, sink);
}
void imp__vertex_scatter(const struct imp_tracer *tracer, const struct imp_vertex *v,
                         const imp_spec *bar, struct imp_sink *sink)
{
    vertex_scatter(tracer, v, bar, sink);
}

static inline void reverse_begin(void *taker, const struct imp_vertex *v)
{
    struct reverse *r = taker;
    for (int j = 0; j < v->bsdf->n_in; j++) r->bar[j] = (imp_spec){0};
    r->any = false;
}
static inline void reverse_scatterer(void *taker, const struct imp_vertex *v,
                                     const imp_spec *d, imp_spec adjoint)
{
    struct reverse *r = taker;
    for (int j = 0; j < v->bsdf->n_in; j++) r->bar[j] += d[j] * adjoint;
    r->any = true;
}
static inline void reverse_end(void *taker, const struct imp_vertex *v)
{
    const struct reverse *r = taker;
    if (r->any) vertex_scatter(r->to.tracer, v, r->bar, r->to.sink);
}

static inline void both_end(void *taker, const struct imp_vertex *v)
{
    struct reverse *r = taker;
    if (!r->any) return;
    vertex_scatter(r->to.tracer, v, r->bar, r->to.sink);
    for (int j = 0; j < v->bsdf->n_in; j++) r->bar[j] *= r->to.ratio;
    vertex_scatter(r->to.tracer, v, r->bar, r->to.second);
}

static void reverse_track(void *taker, const struct imp_track *track,
                          const struct imp_carried *carried, const imp_spec *value,
                          imp_spec adjoint)
{
    const struct reverse *r = taker;
    imp__track_sweep(r->to.tracer, track, carried, value, adjoint, r->to.sink);
}
static void reverse_input(void *taker, const struct imp_input *const *input,
                          const struct imp_texcoord *at, const imp_spec *d)
{
    const struct reverse *r = taker;
    imp__inputs_scatter(input, 1, at, d, r->to.sink);
}

static void both_track(void *taker, const struct imp_track *track,
                       const struct imp_carried *carried, const imp_spec *value,
                       imp_spec adjoint)
{
    const struct reverse *r = taker;
    reverse_track(taker, track, carried, value, adjoint);
    imp__track_sweep(r->to.tracer, track, carried, value, adjoint * r->to.ratio,
                     r->to.second);
}
static void both_input(void *taker, const struct imp_input *const *input,
                       const struct imp_texcoord *at, const imp_spec *d)
{
    imp_spec own = *d;
    imp__sweep_inputs(&((struct reverse *)taker)->to, input, 1, at, &own);
}

static const struct imp_pieces_ops reverse_ops = {.emitter = reverse_emitter,
                                                  .scatterer_begin = reverse_begin,
                                                  .scatterer = reverse_scatterer,
                                                  .scatterer_end = reverse_end,
                                                  .track = reverse_track,
                                                  .input = reverse_input};

static const struct imp_pieces_ops both_ops = {.emitter = both_emitter,
                                               .scatterer_begin = reverse_begin,
                                               .scatterer = reverse_scatterer,
                                               .scatterer_end = both_end,
                                               .track = both_track,
                                               .input = both_input};

/* From v to the last vertex. */
static inline __attribute__((always_inline)) bool
reverse_sweep(const struct imp_pieces_ops *ops, struct reverse *r,
              const struct imp_walk *walk, const struct imp_vertex *v, int depth,
              imp_spec *adjoint)
{
    const struct imp_tracer *tracer = r->to.tracer;
    imp_spec P = *adjoint;
    for (; v; v = v->next, depth++) {
        imp__vertex_fetch(v->next, sizeof *v);
        for (const struct imp_side *s = v->side; s; s = s->next) {
            imp__walk_sweep_values(tracer, &s->walk, P, r->to.sink);
            if (r->to.second)
                imp__walk_sweep_values(tracer, &s->walk, P * r->to.ratio, r->to.second);
        }
        const struct imp_adjoints a = imp__adjoints_at(walk, depth, P);
        imp__vertex_pieces(ops, r, tracer, walk, v, depth, &a);
        P *= v->w;
        if (imp__is_zero_used(P, v->carried)) return false;
    }
    *adjoint = P;
    return true;
}

/* `one`: nothing goes to a second sink. */
static inline __attribute__((always_inline)) bool
vertices_sweep(const struct imp_sweep *s, const bool one, const struct imp_walk *walk,
               const struct imp_vertex *v, int depth, imp_spec *P)
{
    struct reverse reverse; /* clearing all of it takes time */
    reverse.to = *s;
    return reverse_sweep(one ? &reverse_ops : &both_ops, &reverse, walk, v, depth, P);
}

bool imp__sweep_vertices(const struct imp_sweep *s, const struct imp_walk *walk,
                         const struct imp_vertex *v, int depth, imp_spec *P)
{
    return s->second ? vertices_sweep(s, false, walk, v, depth, P)
                     : vertices_sweep(s, true, walk, v, depth, P);
}

void imp__walk_sweep_values(const struct imp_tracer *tracer, const struct imp_walk *walk,
                            imp_spec adjoint, struct imp_sink *sink)
{
    if (walk->dropped || !walk->valid) return;
    if (imp_unlikely(walk->reduced != NULL)) {
        walk->reduced->sweep(tracer, walk, adjoint, sink);
        return;
    }
    const struct imp_sweep to = {tracer, sink, NULL, NULL, {0}};
    imp_spec P = adjoint;
    vertices_sweep(&to, true, walk, walk->first, walk->depth, &P);
    if (walk->moving) walk->moving->sweep(tracer, walk, adjoint, sink);
}

/* The second adjoint over the first, lane by lane. False: the first is 0 where the second is not. */
static inline bool adjoints_divide(imp_spec first, imp_spec second, imp_spec *ratio)
{
    const imp_spec zero = {0};
    const __typeof__(first == zero) none = first == zero, alone = none & (second != zero);
    *ratio = (imp_spec)(~none & (__typeof__(none))(second / first));
    return !((alone[0] | alone[1]) | (alone[2] | alone[3]));
}

void imp__walk_sweep_both(const struct imp_tracer *tracer, const struct imp_walk *walk,
                          imp_spec adjoint, imp_spec other,
                          const struct imp_sink_pair *to)
{
    struct imp_sweep s = {tracer, to->first, to->second, to, {0}};
    if (walk->dropped || !walk->valid) return;
    if (imp_unlikely(walk->moving || tracer->sensor->gain) ||
        (walk->reduced && !walk->reduced->both) ||
        !adjoints_divide(imp__walk_values(tracer, walk, adjoint),
                         imp__walk_values(tracer, walk, other), &s.ratio)) {
        imp__walk_sweep(tracer, walk, adjoint, to->first);
        imp__walk_sweep(tracer, walk, other, to->second);
        return;
    }
    imp_spec P = imp__walk_values(tracer, walk, adjoint);
    if (walk->reduced) walk->reduced->both(tracer, walk, P, s.ratio, to);
    else vertices_sweep(&s, false, walk, walk->first, walk->depth, &P);
}

/* ---- Forward: pieces along a direction ------------------------------------------- */

struct direction {
    const struct imp_active *active;
    const double *x_dot;
};

static double direction_at(const void *payload, int param, size_t element)
{
    const struct direction *d = payload;
    const int64_t base = d->active->base[param];
    if (base < 0) return 0;
    return d->x_dot[imp__active_at(d->active, param, element)] *
           imp__active_slope(d->active, param, element);
}

struct forward {
    const struct imp_tracer *tracer;
    struct direction direction;
    imp_spec L_dot, on_segments;
    imp_spec in_dot[IMP_INPUTS_MAX]; /* of the scatterer's inputs */
};

imp_spec imp__emitter_tangent(const struct imp_tracer *tracer, int emitter,
                              struct imp_emission x, struct imp_texcoord at,
                              imp_dot_fn *dot, const void *x_dot)
{
    const struct imp_emitter *e = tracer->scene->emitters[emitter];
    imp_spec d[IMP_INPUTS_MAX], in_dot[IMP_INPUTS_MAX], sum = {0};
    emitter_d(e, tracer->active, &x, &at, d);
    imp__inputs_tangent(e->input, e->n_in, &at, dot, x_dot, in_dot);
    for (int j = 0; j < e->n_in; j++) sum += d[j] * in_dot[j];
    return sum;
}
static void forward_emitter(void *taker, struct imp_emitter_piece *p)
{
    struct forward *f = taker;
    f->L_dot += imp__emitter_tangent(f->tracer, p->emitter, p->x, p->at, direction_at,
                                     &f->direction) *
                p->through[0] * p->through[1] * p->adjoint;
}

static void vertex_tangent(const struct imp_tracer *tracer, const struct imp_vertex *v,
                           const struct direction *direction, imp_spec *in_dot)
{
    const struct imp_texcoord at = imp__vertex_at(v);
    imp__inputs_tangent(v->bsdf->input, v->bsdf->n_in, &at, direction_at, direction,
                        in_dot);
    imp__extinction_drop(tracer, v, in_dot);
}
void imp__vertex_tangent(const struct imp_tracer *tracer, const struct imp_vertex *v,
                         const double *x_dot, imp_spec *in_dot)
{
    const struct direction direction = {tracer->active, x_dot};
    vertex_tangent(tracer, v, &direction, in_dot);
}
static void forward_begin(void *taker, const struct imp_vertex *v)
{
    struct forward *f = taker;
    vertex_tangent(f->tracer, v, &f->direction, f->in_dot);
}
static void forward_scatterer(void *taker, const struct imp_vertex *v, const imp_spec *d,
                              imp_spec adjoint)
{
    struct forward *f = taker;
    for (int j = 0; j < v->bsdf->n_in; j++) f->L_dot += d[j] * f->in_dot[j] * adjoint;
}

static void forward_track(void *taker, const struct imp_track *track,
                          const struct imp_carried *carried, const imp_spec *value,
                          imp_spec adjoint)
{
    struct forward *f = taker;
    f->on_segments += adjoint * imp__track_tangent(f->tracer, track, carried, value,
                                                   direction_at, &f->direction);
}
imp_spec imp__track_tangent_along(const struct imp_tracer *tracer,
                                  const struct imp_track *track,
                                  const struct imp_carried *carried,
                                  const imp_spec *value, const double *x_dot)
{
    const struct direction direction = {tracer->active, x_dot};
    return imp__track_tangent(tracer, track, carried, value, direction_at, &direction);
}
static void forward_input(void *taker, const struct imp_input *const *input,
                          const struct imp_texcoord *at, const imp_spec *d)
{
    struct forward *f = taker;
    imp_spec in_dot;
    imp__inputs_tangent(input, 1, at, direction_at, &f->direction, &in_dot);
    f->on_segments += *d * in_dot;
}
static void forward_segments_end(void *taker)
{
    struct forward *f = taker;
    f->L_dot += f->on_segments;
    f->on_segments = (imp_spec){0};
}

static const struct imp_pieces_ops forward_ops = {.emitter = forward_emitter,
                                                  .scatterer_begin = forward_begin,
                                                  .scatterer = forward_scatterer,
                                                  .track = forward_track,
                                                  .input = forward_input,
                                                  .segments_first = true,
                                                  .segments_end = forward_segments_end};

imp_spec imp__walk_tangent_values(const struct imp_tracer *tracer,
                                  const struct imp_walk *walk, const double *x_dot)
{
    int depth = walk->depth + walk->n - 1;
    struct forward f;
    f.tracer = tracer;
    f.direction = (struct direction){tracer->active, x_dot};
    f.L_dot = f.on_segments = (imp_spec){0};
    if (walk->dropped || !walk->valid) return f.L_dot;
    if (imp_unlikely(walk->reduced != NULL)) /* never of imp_tracer.swept_only */
        return walk->reduced->tangent(tracer, walk, direction_at, &f.direction);
    for (const struct imp_vertex *v = walk->last; v; v = v->prev, depth--) {
        f.L_dot *= v->w;
        for (const struct imp_side *s = v->side; s; s = s->next)
            f.L_dot += imp__walk_tangent_values(tracer, &s->walk, x_dot);
        const struct imp_adjoints a = imp__adjoints_at(walk, depth, imp__spec(1));
        imp__vertex_pieces(&forward_ops, &f, tracer, walk, v, depth, &a);
    }
    if (walk->moving) f.L_dot += walk->moving->tangent(tracer, walk, x_dot);
    return f.L_dot;
}

imp_spec imp__walk_tangent(const struct imp_tracer *tracer, const struct imp_walk *walk,
                           const double *x_dot)
{
    const imp_spec values = imp__walk_tangent_values(tracer, walk, x_dot);
    imp_spec L_dot = imp__walk_channels(tracer, walk, values);
    if (imp_unlikely(tracer->sensor->gain != NULL))
        L_dot += imp__gain_tangent(tracer, walk, x_dot);
    return L_dot;
}
