/* SPDX-License-Identifier: Apache-2.0
 *
 * First rays of walks from lights in lanes: on the scene's only light, if it has a form in lanes and a
 * radiance that is the same everywhere; else, and where the sensor may see the light's point itself, by
 * the step of walks alone (light_start.c). */
#include "light_bundle.h"
#include "walk/bundle/lanes_leave.h"
#include "walk/core/emitted.h"

/* Walk k, in flight already. */
static void begin_alone(struct imp_light_bundle *l, struct imp_arena *arena, int k,
                        const struct imp_light_given *given)
{
    const struct imp_tracer *tracer = l->bundle.tracer;
    struct imp_light_walk *out = &l->out[k];
    struct imp_light_flights *to = &l->flights[1];
    struct imp_light_step w;
    imp__light_step_begin(tracer, arena, NULL, out, &w);
    w.given = given;
    const bool sent = imp__light_start(&w);
    l->end[k] = w.end;
    if (out->reach) imp__reach_value(tracer, &out->walk, out->reach, out->walk.first->b);
    if (!sent) return;
    const int i = to->rays.ray.n++;
    imp__column_put(to->rays.ray.o, i, w.s.o);
    imp__column_put(to->rays.ray.d, i, w.s.d);
    to->rays.ray.far[i] = w.s.t_max;
    if (to->rays.ray.time) to->rays.ray.time[i] = out->walk.time;
    imp__color_put(to->rays.beta, l->bundle.colors, i, imp__spec(1));
    imp__color_put(to->carries, l->bundle.colors, i, out->walk.first->w);
    to->rays.walk[i] = k;
}

/* Light of the only emitter that leaves by these cosines, as decided. */
static void radiance(const struct imp_light_bundle *l, const struct imp_wide_emission *x,
                     int first, unsigned bits, struct imp_wide_color *le)
{
    const struct imp_scene *scene = l->bundle.tracer->scene;
    const struct imp_emitter *e = scene->emitters[0];
    const imp_wide cosine = imp__wide_decide(x->cos_light);
    if (l->bundle.colors == 3) {
        *le = imp__wide_color(e->input[0]->value);
        for (int c = 0; c < 3; c++)
            le->c[c] = imp__wide_choose(cosine > imp__wide(0), le->c[c], imp__wide(0));
        return;
    }
    imp_spec rows[IMP_WIDE_LANES] = {{0}};
    for (; bits; bits &= bits - 1) {
        const int k = __builtin_ctz(bits);
        const struct imp_emission at = {
            .uv = {imp__decide1(x->uv[0][k]), imp__decide1(x->uv[1][k])},
            .dist = 1,
            .cos_light = cosine[k],
            .d = imp__decide(imp__wide3_lane(&x->d, k))};
        rows[k] =
            imp__emitter_radiance(scene, 0, &at, imp__decide(imp__wide3_lane(&x->p, k)),
                                  &l->bundle.waves[first + k]->carried);
    }
    *le = imp__color_of_rows(rows);
}

/* Walks k, .., of which those with bits have a point and a direction. */
static void send(struct imp_light_bundle *l, const struct imp_wide_emission *x, int k,
                 unsigned bits)
{
    const struct imp_scene *scene = l->bundle.tracer->scene;
    const int colors = l->bundle.colors;
    const imp_wide zero = imp__wide(0), per = scene->light_cdf[0] * x->pdf_p * x->pdf_d;
    struct imp_light_flights *to = &l->flights[1];
    const int n = to->rays.ray.n;
    struct imp_wide_color le;
    bits &= imp__wide_bits((per > zero) & (x->cos_p > zero));
    radiance(l, x, k, bits, &le);
    imp_wide_truth none = (le.c[0] == zero) & (le.c[1] == zero) & (le.c[2] == zero);
    if (colors > 3) none &= le.c[3] == zero;
    bits &= ~imp__wide_bits(none);
    const imp_wide by = 1 / imp__wide_decide(per / x->cos_p);
    imp__lanes_ray_append(&to->rays.ray, bits, x->p, x->ng, x->d);
    for (int c = 0; c < colors; c++) {
        imp__wide_append(&to->rays.beta[c][n], bits, imp__wide(1));
        imp__wide_append(&to->carries[c][n], bits, le.c[c] * by);
    }
    for (; bits; bits &= bits - 1) {
        const int i = to->rays.ray.n++, walk = k + __builtin_ctz(bits);
        to->rays.walk[i] = walk;
        if (to->rays.ray.time) to->rays.ray.time[i] = l->out[walk].walk.time;
    }
}

/* Walks k, .., k + n - 1, n <= IMP_WIDE_LANES, on the only light. */
static void begin(struct imp_light_bundle *l, struct imp_arena *arena,
                  const struct imp_emitter_lanes *lanes, bool even, int k, int n)
{
    const struct imp_tracer *t = l->bundle.tracer;
    const struct imp_walk_integrator *integrator = t->integrator;
    struct imp_wide_block keys = {.low = {0}};
    struct imp_wide_emission x;
    struct imp_light_seen seen;
    imp_wide point[2];
    for (int i = 0; i < IMP_WIDE_LANES; i++)
        keys.hash[i] = l->bundle.set[k + imp_min(i, n - 1)];
    imp__light_starts_draw(t, lanes, &keys, point, &x);
    unsigned bits = imp__bits_first(n), alone = even ? 0 : bits;
    bits &= imp__wide_bits(x.drawn);
    if (even && integrator->lights && t->sensor->ops->connect &&
        (integrator->max_depth < 0 || integrator->max_depth >= 1))
        alone = imp__light_bundle_see(t->sensor, &keys, 0, &x.p, bits, &seen);
    bits &= ~alone;
    if (integrator->directions &&
        (integrator->max_depth < 0 || integrator->max_depth >= 2))
        send(l, &x, k, bits);
    for (; alone; alone &= alone - 1) {
        const int i = __builtin_ctz(alone);
        const struct imp_light_given given = imp__light_given(&x, point, i);
        begin_alone(l, arena, k + i, &given);
    }
}

bool imp__light_bundle_begin(struct imp_light_bundle *l, struct imp_arena *arena,
                             int64_t first)
{
    const struct imp_tracer *t = l->bundle.tracer;
    const int n = l->bundle.n;
    for (int k = 0; k < n; k++) {
        if (!imp__light_walk_start(t, arena, first + k, &l->out[k])) return false;
        l->end[k] = &l->out[k].reach;
        l->bundle.set[k] = l->out[k].walk.key.state;
        if (l->bundle.colors > 3) l->bundle.waves[k] = l->out[k].walk.waves;
    }
    const struct imp_emitter_lanes *lanes = imp__light_only(t);
    if (!lanes) {
        for (int k = 0; k < n; k++) begin_alone(l, arena, k, NULL);
        return !arena->failed;
    }
    const bool even = imp__emitter_even(t->scene->emitters[0], NULL);
    for (int k = 0; k < n; k += IMP_WIDE_LANES)
        begin(l, arena, lanes, even, k, imp_min(n - k, IMP_WIDE_LANES));
    return !arena->failed;
}
