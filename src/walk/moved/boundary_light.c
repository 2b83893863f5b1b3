/* SPDX-License-Identifier: Apache-2.0
 *
 * Silhouettes between a light and what it lights (boundary.h). */
#include "boundary_one_sided.h"
#include "moved_sky.h"
#include "walk/core/emitted.h"

static int light_choose(const struct imp__boundary *b, double u, double *pmf)
{
    const struct imp_scene *scene = b->tracer->scene;
    int k = 0;
    while (k < scene->n_emitters - 1 && !(u < b->light_cdf[k])) k++;
    *pmf = b->light_cdf[k] - (k > 0 ? b->light_cdf[k - 1] : 0);
    return k;
}

/* Where the line to the edge begins, and what it carries. */
struct source {
    int light;            /* emitter */
    struct imp_surface y; /* of a light with a shape */
    imp_v3 p; /* its point; of parallel light the direction in which it travels */
    bool parallel, sky;
    enum imp__sky_part part; /* of a sky */
    bool glued;              /* the line's end goes with the light */
    double density; /* of the light, and of its point per area, or direction of a sky */
};

/* Where its sun moves, a sky is the disc or what is around it, by what they send along the line. */
static void part_draw(const struct imp__edge_draw *d, struct source *s)
{
    const struct imp_scene *scene = d->b->tracer->scene;
    const struct imp_emitter *e = scene->emitters[s->light];
    const struct imp_carried *carried = imp__edge_waves(d);
    const double disc = imp__sum_used(imp__sky_part_from(e, IMP_SKY_DISC, -s->p, carried),
                                      scene->lanes),
                 rest = imp__sum_used(
                     imp__sky_part_from(e, IMP_SKY_AROUND, -s->p, carried), scene->lanes);
    const double share = disc > 0 ? disc / (disc + rest) : 0;
    s->glued = imp__u01(d->key, IMP_EDGE_PART) < share;
    s->part = s->glued ? IMP_SKY_DISC : IMP_SKY_AROUND;
    s->density *= s->glued ? share : 1 - share;
}

static struct source source_draw(const struct imp__edge_draw *d)
{
    struct source s = {.density = 0};
    double aim[3];
    const double u[2] = {imp__u01(d->key, IMP_EDGE_LIGHT_U),
                         imp__u01(d->key, IMP_EDGE_LIGHT_V)};
    s.light = light_choose(d->b, imp__u01(d->key, IMP_EDGE_LIGHT), &s.density);
    struct imp_emitter *e = d->b->tracer->scene->emitters[s.light];
    if (!(s.density > 0)) return s;
    if (e->shape) {
        e->shape->ops->sample_area(e->shape, u, &s.y);
        s.density /= e->shape->area;
        s.p = s.y.p;
        return s;
    }
    if (e->ops->flags & IMP_EMITTER_ENVIRONMENT) {
        const struct imp_scene *scene = d->b->tracer->scene;
        const imp_v3 from = (scene->lo + scene->hi) * 0.5;
        struct imp_light_sample to = {.pdf = 0};
        s.density *= e->ops->sample(e, &from, u, &to) ? to.pdf : 0;
        s.p = -to.wi;
        s.parallel = s.sky = true;
        s.glued = d->b->moves->skies;
        if (s.density > 0 && imp__sky_in_parts(d->b->moves, s.light)) part_draw(d, &s);
        return s;
    }
    e->ops->aim(e, aim, false);
    s.p = imp__v3(aim[0], aim[1], aim[2]);
    s.parallel = e->ops->flags & IMP_EMITTER_FAR;
    return s;
}

/* The velocity of the light's end of the line counts so. */
static struct imp__flux_end source_end(const struct imp__edge_draw *d,
                                       const struct source *s, imp_v3 bar)
{
    const struct imp_scene *scene = d->b->tracer->scene;
    const struct imp_shape *shape = scene->emitters[s->light]->shape;
    if (!shape)
        return (struct imp__flux_end){{.p = s->p}, {.v = bar}, false, s->light + 1, {0}};
    const struct imp_located located = imp__located_drawn(shape, &s->y.located, s->y.uv);
    const struct imp__glued lit =
        imp__glued_at(scene, shape->index, &located, 0, d->time, s->y.ng);
    return imp__flux_glued(&lit, bar);
}

imp_spec imp__edge_sent(const struct imp__edge_draw *d, int light, double cosine,
                        imp_v3 along)
{
    const struct imp_emitter *e = d->b->tracer->scene->emitters[light];
    struct imp_texcoord there = {.shape = e->shape, .carried = imp__edge_waves(d)};
    const struct imp_emission x = {.dist = 1, .cos_light = cosine, .d = along};
    imp_spec in[IMP_INPUTS_MAX], le;
    imp__emitter_place(e, &x, &there);
    imp__inputs_eval(e->input, e->n_in, &there, in);
    e->ops->eval(e, in, &x, &le);
    return le;
}

static imp_spec sent(const struct imp__edge_draw *d, const struct source *s,
                     double cosine, imp_v3 along)
{
    const struct imp_scene *scene = d->b->tracer->scene;
    const struct imp_emitter *e = scene->emitters[s->light];
    if (s->sky && s->part != IMP_SKY_WHOLE)
        return imp__sky_part_from(e, s->part, -s->p, imp__edge_waves(d));
    if (s->sky) return imp__sky_radiance_from(scene, s->light, -s->p, imp__edge_waves(d));
    return imp__edge_sent(d, s->light, cosine, along);
}

/* As imp__edge_side, of a curved shape. */
static int round_side(const struct imp__edge_draw *d, imp_v3 m)
{
    const int side = imp__dot(m, d->out) > 0 ? 1 : -1;
    const imp_v3 wall = d->item->wall; /* of a can with a lid */
    if (!d->rim || imp__is_zero(wall)) return side;
    return (imp__dot(m, wall) > 0 ? 1 : -1) == side ? side : 0;
}

/* A line past the edge. */
struct line {
    const struct source *from;
    imp_v3 m;
    double t_y;
};

/* The ends of a flux to a point so far behind the edge. */
static void ends_set(const struct imp__edge_draw *d, const struct line *l, double t_x,
                     struct imp__edge_light *light)
{
    const bool parallel = l->from->parallel;
    const double far = parallel ? 1 : l->t_y / (t_x + l->t_y); /* of V_line that is x' */
    light->slide = l->m * -far;
    light->n_ends = imp__edge_ends(d, l->m, light->end);
    if (!l->from->sky || l->from->glued)
        light->end[light->n_ends++] =
            source_end(d, l->from, l->m * (parallel ? t_x : far - 1));
}

#define INSIDE                                                                           \
    1e-3 /* the line inside meets what is behind the edge so much, or less, earlier */

/* Where light samples pass masks, and in a medium: the line past the edge, from o along `out`, and beside it along `in`,
 * which the edge's own faces may let pass in part; both of the length 1 to the edge, t_y away. Sets
 * what is met behind the edge, and *T, what passes out there less what passes inside. */
static bool jump_follow(struct imp__edge_draw *d, imp_v3 o, imp_v3 out, imp_v3 in,
                        double t_y, struct imp_hit *hit, struct imp_surface *at,
                        imp_spec *T)
{
    const double contact = IMP_CONTACT * d->b->size;
    struct imp__line before, behind, inside;
    *T = imp__spec(0);
    if (!imp__edge_line(d, o, out, 1 + contact / t_y, &before)) return false;
    const imp_v3 w = imp__normalize(out);
    if (!imp__edge_follow(d, o + out, w, contact, 0, hit, at, &behind) ||
        behind.mirrors.n > 0)
        return false;
    const double till = 1 + (1 - INSIDE) * hit->t / t_y;
    *T = before.T * behind.T;
    if (imp__edge_passes(d) && imp__edge_line(d, o, in, till, &inside)) *T -= inside.T;
    *T *= behind.times;
    return true;
}

/* Parallel light does not, where the medium around the scene has no end. */
static bool comes_through(const struct imp__edge_draw *d, const struct source *s)
{
    const struct imp_medium *outside =
        d->b->media ? d->b->moves->borders.outside : d->b->fog;
    return !s->parallel || !outside || outside->majorants;
}

static void lit_add(struct imp__edge_draw *d, const struct line *l, struct imp_hit *hit,
                    const struct imp_surface *at, struct imp__edge_light *light)
{
    ends_set(d, l, imp__length(at->p - d->p), light);
    imp__edge_reach(d, hit, at, light);
}

/* What is lit is what sees the light: of all that is met behind the edge, up to what both senses of the
 * line meet (boundary_one_sided.c). */
static void seen_work(struct imp__edge_draw *d, const struct line *l, imp_v3 o, imp_v3 to,
                      struct imp__edge_light light)
{
    enum { WALLS = 16 };
    const struct imp__boundary *b = d->b;
    const struct imp_scene *scene = b->tracer->scene;
    const double contact = IMP_CONTACT * b->size / l->t_y;
    bool meter =
        b->tracer->sensor->shape && (!l->from->sky || b->drawn_to_meter[l->from->light]);
    struct imp_hit hit = {.t = 1};
    for (int k = 0; k < WALLS; k++) {
        struct imp_surface at;
        struct imp__edge_light own = light;
        struct imp__meter_point x;
        const bool meets = imp__intersect_at(scene, d->time, &o, &to,
                                             (double)hit.t + contact, INFINITY, &hit);
        if (meter && imp__meter_meet(d, o, to, meets ? &hit : NULL, &x)) {
            meter = false;
            if (imp__one_sided_sees(d, &x.at, o)) {
                ends_set(d, l, imp__length(x.at.p - d->p), &own);
                imp__meter_reach(d, &x, &own);
                own = light;
            }
        }
        if (!meets) return;
        imp__hit_surface(scene, &hit, &o, &to, &at);
        if (imp__one_sided_sees(d, &at, o)) lit_add(d, l, &hit, &at, &own);
        if (scene->shapes[hit.shape]->geometry != IMP_CURVES) return;
    }
}

void imp__draw_light(struct imp__edge_draw *d)
{
    const struct imp__boundary *b = d->b;
    const struct imp_scene *scene = b->tracer->scene;
    if (b->n_lights == 0) return;
    const struct source s = source_draw(d);
    const struct imp_emitter *e = scene->emitters[s.light];
    if (!(s.density > 0) || !comes_through(d, &s) ||
        !imp__edge_silhouette(d, s.p, s.parallel))
        return;

    /* Parallel light: from outside the scene. */
    const imp_v3 from = s.parallel ? d->p - s.p * b->outside : s.p;
    const imp_v3 r = d->p - from, turned = imp__cross(d->along, r);
    const double t_y = imp__length(r), sine = imp__length(turned) / t_y;
    const double cosine = e->shape ? imp__dot(s.y.n, r) / t_y : 1;
    if (!(sine > 0) || !(cosine > IMP_GRAZING)) return;
    imp_v3 m = turned * (1 / (sine * t_y));
    const int side = d->edge ? imp__edge_side(d->edges, d->edge, m) : round_side(d, m);
    if (side == 0) return;
    m *= (double)side;

    /* One ray past the edge; parts of its length to there. */
    const imp_v3 o = e->shape ? imp__offset(from, s.y.ng, r) : from;
    const double beside = IMP_BESIDE * (t_y + imp__length(d->p));
    const imp_v3 to = d->p + m * beside - o;
    const bool backwards = b->one_sided && d->item && d->item->shape >= 0 && d->rim &&
                           scene->shapes[d->item->shape]->geometry == IMP_CURVES;
    if (imp__edge_merges(d, backwards ? -to : to, beside)) return;
    struct imp_hit hit;
    struct imp_surface at;
    imp_spec T = imp__spec(1);
    const bool follows = imp__edge_fades(d) || (b->passes && b->through);
    bool meets = true;
    if (imp_unlikely(follows)) {
        const imp_v3 inside = d->p - m * beside - o;
        meets = jump_follow(d, o, to, inside, t_y, &hit, &at, &T);
        if (imp__is_zero_used(T, d->waves)) return;
    } else if (imp_likely(!b->one_sided)) {
        meets = imp__intersect_at(scene, d->time, &o, &to, 0, INFINITY, &hit);
        if (meets && hit.t < 1 + IMP_CONTACT * b->size / t_y) return;
    }

    const imp_spec le = sent(d, &s, cosine, imp__normalize(to));
    const double spread = s.parallel ? 1 : t_y * t_y;
    struct line line = {&s, m, t_y};
    struct imp__edge_light light = {.w = imp__normalize(to), .behind = 1};
    if (imp_unlikely(follows && hit.shape < 0 && e->shape)) {
        double slope;
        T *= imp__glued_part(e, imp__length(at.p - s.p), &slope);
    }
    light.light = T * le * (-cosine * sine * d->inv_pdf / (spread * s.density));
    if (imp_unlikely(b->one_sided && !follows)) {
        seen_work(d, &line, o, to, light);
        return;
    }
    struct imp__meter_point x;
    if (b->tracer->sensor->shape && (!s.sky || b->drawn_to_meter[s.light]) &&
        imp__meter_meet(d, o, to, meets ? &hit : NULL, &x)) {
        ends_set(d, &line, imp__length(x.at.p - d->p), &light);
        imp__meter_reach(d, &x, &light);
    }
    if (!meets) return;
    if (imp_likely(!follows)) imp__hit_surface(scene, &hit, &o, &to, &at);
    lit_add(d, &line, &hit, &at, &light);
}

/* A line through a border, and what is scattered there. */
void imp__draw_border_light(struct imp__edge_draw *d)
{
    const struct imp__boundary *b = d->b;
    struct imp__border_point x;
    if (b->n_lights == 0) return;
    const struct source s = source_draw(d);
    const struct imp_emitter *e = b->tracer->scene->emitters[s.light];
    if (!(s.density > 0) || !comes_through(d, &s) || !imp__border_point(d, &x)) return;

    const imp_v3 from = s.parallel ? d->p - s.p * b->outside : s.p;
    const imp_v3 r = d->p - from, w = imp__normalize(r);
    const double t_y = imp__length(r), cosine = e->shape ? imp__dot(s.y.n, w) : 1;
    if (!(cosine > IMP_GRAZING)) return;
    const imp_v3 o = e->shape ? imp__offset(from, s.y.ng, r) : from;
    struct imp__line before, behind;
    if (!imp__edge_line(d, o, d->p - o, 1 - IMP_BESIDE, &before)) return;
    const double spread = s.parallel ? 1 : t_y * t_y;
    const imp_spec arrives =
        before.T * sent(d, &s, cosine, w) * (cosine * d->inv_pdf / (spread * s.density));
    struct imp__edge_light light = {
        .w = w, .light = arrives, .behind = 1, .slide = -d->out};
    light.n_ends = imp__edge_ends(d, d->out, light.end);
    imp__border_scatter(d, &x, light);

    struct imp_hit hit;
    struct imp_surface at;
    if (imp__is_zero_used(x.more, d->waves) ||
        !imp__edge_follow(d, imp__offset(d->p, d->out, w), w, 0, 0, &hit, &at, &behind))
        return;
    const struct line line = {&s, d->out, t_y};
    light.light = arrives * behind.T * x.more * -behind.times;
    if (hit.shape < 0 && e->shape) {
        double slope;
        light.light *= imp__glued_part(e, imp__length(at.p - s.p), &slope);
    }
    ends_set(d, &line, imp__length(at.p - d->p), &light);
    imp__edge_reach(d, &hit, &at, &light);
}
