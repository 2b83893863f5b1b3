/* SPDX-License-Identifier: Apache-2.0
 *
 * How the camera sees a place over curved mirrors and through clear glass (boundary.h). Such a chain is a
 * root: of all rays that leave the eye, and are reflected and bent by the surfaces of the chain in turn,
 * the one that meets the place. It is found as specular manifold sampling does (Zeltner, Georgiev, Jakob
 * 2020): a ray is drawn, which chooses surfaces and whether they reflect, and Newton's method leads from
 * there to a root, or not. The same root is then looked for again, by draws that are independent, until it
 * is found: K draws, whose mean is one over the probability p of finding it, so that of all roots r
 *
 *     E[K f(r)] = sum over r of p(r) f(r)/p(r). */
#include "base/arguments.h"
#include "bent_chain.h"
#include "moved_mirror.h"

/* ---- What is seen ------------------------------------------------------------------------- */

/* The surface at q, looked at from where its normal n points to. */
static bool surface_met(const struct imp__edge_draw *d, const struct imp__bent_surface *s,
                        imp_v3 n, struct imp_hit *hit, struct imp_surface *at)
{
    const struct imp_scene *scene = d->b->tracer->scene;
    const imp_v3 o = imp__offset(s->q, n, n), down = -n;
    const double near = imp__dot(n, o - s->q);
    if (!imp__intersect_at(scene, d->time, &o, &down, 0, 2 * near, hit)) return false;
    if (hit->place != s->place ||
        (hit->shape != s->shape &&
         hit->shape != imp__placed_shape(scene, s->shape, s->place)))
        return false;
    if (s->plane > 0 && imp__plane_number(d->b, hit) != s->plane)
        return false; /* of another face, which has roots of its own */
    imp__hit_surface(scene, hit, &o, &down, at);
    at->p = s->q;
    return true;
}

static bool leg_open(const struct imp__edge_draw *d, struct imp__sight *s, imp_v3 o,
                     imp_v3 end)
{
    struct imp__line line;
    if (!imp__edge_line(d, o, end - o, 1, &line)) return false;
    s->T *= line.T;
    s->bounces += line.bounces;
    return true;
}

/* From the root's place to the camera: what is on the way. */
static bool root_seen(struct imp__edge_draw *d, const struct imp__bent_root *x,
                      struct imp__sight *s)
{
    const struct imp__bent_chain *all = &x->chain;
    s->T = imp__spec(1);
    imp_v3 before = {0}; /* on the surface nearer to the place */
    for (int k = all->n - 1; k >= 0; k--) {
        const struct imp__bent_surface *at = &all->at[k];
        const imp_v3 next = k > 0 ? all->at[k - 1].q : d->eye,
                     w = k == 0 && d->b->parallel
                             ? -d->eye
                             : imp__normalize(next - at->q); /* to the camera */
        const imp_v3 n = imp__dot(at->normal, w) < 0 ? -at->normal : at->normal;
        struct imp_hit hit;
        struct imp_surface there;
        double ratio;
        if (!surface_met(d, at, n, &hit, &there)) return false;
        /* As the ray from the camera sees it. */
        const imp_spec f =
            at->ratio == 0
                ? imp__edge_reflected(d, &hit, &there, -w)
                : imp__edge_refracted(d, &hit, &there, -w, &ratio) * imp__sqr(at->ratio);
        if (imp__is_zero_used(f, d->waves)) return false;
        if (k < all->n - 1) {
            const imp_v3 to = all->at[k + 1].q - at->q;
            if (!leg_open(d, s, imp__offset(before, all->at[k + 1].normal, -to),
                          imp__offset(at->q, at->normal, to)))
                return false;
        }
        s->T *= f;
        s->bounces++;
        if (!imp__mirror_add(d, &s->mirrors, &hit, &there)) return false;
        s->mirrors.last->ratio = at->ratio;
        s->mirrors.bends = true;
        before = at->q;
    }
    if (!imp__sight_film(d, s, before)) return false;
    if (!d->b->parallel) s->to.weight *= imp__sqr(imp__length(before - d->eye));
    s->to.weight /= fabs(x->det);
    return isfinite(s->to.weight);
}

#define COUNTS 0.1   /* what a root lets through that is always kept */
#define STAGE  16384 /* draws, after which a draw goes on by chance */

/* Roots that let little through are kept by chance: over glass that reflects inside there are many, and each
 * is looked for again as often as those that count. */
static double kept_chance(const struct imp__edge_draw *d, const struct imp__sight *s)
{
    return imp_min(imp__max_used(s->T, d->waves) / COUNTS, 1);
}

/* How often a root is looked for over one ball or within flat glass, where all are known; else by trials. */
struct ways {
    double round, flat, trials;
};
static struct ways ways_of(const struct imp__edge_draw *d,
                           const struct imp__bent_goal *goal)
{
    const bool known = !(goal->radius > 0);
    const double round = known && d->b->n_balls > 0 ? 2 : 0,
                 flat = !known || goal->far || d->b->n_planes == 0 ? 0
                        : goal->on_glass                           ? 2
                                                                   : 0.1,
                 all = 1 / (round + flat + 1);
    return (struct ways){round * all, flat * all, all};
}

/* A root, and x->draws where it is known. */
static bool root_any(const struct imp__edge_draw *d, struct imp_key key,
                     struct imp__bent_found *x)
{
    const struct ways way = ways_of(d, &x->goal);
    const double u = imp__u01(key, IMP_BENT_WHICH_WAY);
    const bool round = u < way.round, flat = !round && u < way.round + way.flat;
    x->draws = 0;
    if (!round && !flat) return imp__bent_draw(d, key, &x->goal, NULL, &x->root);
    if (!(round ? imp__round_draw : imp__flat_draw)(d, key, &x->goal, &x->root,
                                                    &x->draws))
        return false;
    x->draws /= round ? way.round : way.flat;
    return true;
}

/* The number of draws until one leads there. Behind a stage it goes on with probability 1/2, and counts twice as
 * much, up to twice the number: there is no bound, the mean is the same, and few roots that are hardly ever
 * found take long. */
double imp__bent_draws(const struct imp__edge_draw *d, const struct imp__bent_found *x)
{
    double sum = 0, times = 1;
    if (x->draws > 0) return x->draws;
    const double chance = ways_of(d, &x->goal).trials;
    for (uint64_t k = 1, end = STAGE;; k++) {
        const struct imp_key key = imp__key(d->key.state, x->dims, k);
        struct imp__bent_root again;
        sum += times;
        if (imp__bent_draw(d, key, &x->goal, &x->root, &again)) return sum / chance;
        if (k < end) continue;
        if (imp__u01(key, IMP_BENT_GO_ON) < 0.5) return sum / chance;
        times *= 2;
        end += end;
    }
}

/* A root, of the goal that is set. */
static bool root_reach(struct imp__edge_draw *d, struct imp__sight *s,
                       struct imp__bent_found *x)
{
    const int max = d->b->tracer->integrator->max_depth;
    const struct imp_key key = imp__key(d->key.state, x->dims, 0);
    *s = (struct imp__sight){.eye = d->eye};
    if (!d->b->tracer->sensor->ops->connect || (max >= 0 && max < 2) ||
        !root_any(d, key, x) || !root_seen(d, &x->root, s))
        return false;
    s->chance = kept_chance(d, s);
    return imp__u01(key, IMP_BENT_KEEP) < s->chance;
}

bool imp__bent_reach(struct imp__edge_draw *d, unsigned dims, imp_v3 p,
                     struct imp__sight *s, struct imp__bent_found *x)
{
    x->dims = dims;
    x->goal = (struct imp__bent_goal){.p = p};
    return root_reach(d, s, x);
}

bool imp__bent_reach_far(struct imp__edge_draw *d, imp_v3 w, struct imp__sight *s,
                         struct imp__bent_found *x)
{
    x->dims = 0;
    x->goal = (struct imp__bent_goal){.across = w, .far = true};
    return root_reach(d, s, x);
}

/* Is the draw's point one of an edge of glass? */
static bool is_on_glass(const struct imp__edge_draw *d)
{
    struct imp_hit own = {.shape = -1};
    if (d->edge) {
        const struct imp__edge_face *f = &d->edges->face[d->edge->first];
        own.shape = f->shape;
        own.place = f->place;
    } else if (d->rim && d->item->shape >= 0) {
        own.shape = d->item->shape;
        own.place = d->item->place;
    }
    return own.shape >= 0 && imp__is_glass(imp__hit_bsdf(d->b->tracer->scene, &own));
}
static bool edge_reach(struct imp__edge_draw *d, struct imp__sight *s,
                       struct imp__bent_found *x)
{
    x->dims = 0;
    x->goal = (struct imp__bent_goal){.p = d->p, .on_glass = is_on_glass(d)};
    return root_reach(d, s, x);
}

/* A place on the wall of a cylinder that is touched by what the camera sees. */
static bool wall_reach(struct imp__edge_draw *d, const struct imp__tube *c,
                       struct imp__sight *s, struct imp__bent_found *x)
{
    const struct imp_frame f = imp__frame_from_normal(c->axis);
    const double v = d->u < 0.5 ? 2 * d->u : 2 * d->u - 1;
    x->dims = 0;
    x->goal = (struct imp__bent_goal){.p = c->base, .axis = c->axis, .radius = c->radius};
    if (d->u < 0.5) {
        x->goal.across = c->axis;
        x->goal.p += c->axis * (v * c->length);
    } else x->goal.across = f.s * cos(IMP_PI * v) + f.t * sin(IMP_PI * v);
    if (!root_reach(d, s, x)) return false;
    const double up = imp__dot(c->axis, x->root.p - c->base);
    if (!(up > 0) || !(up < c->length)) return false;
    d->p = x->root.p;
    d->out = imp__normalize(imp__across_axis(c->axis, d->p - c->base));
    d->along = imp__normalize(x->root.along);
    const double rises = fabs(imp__dot(d->along, c->axis)),
                 turns = sqrt(imp_max(1 - rises * rises, 0.0));
    d->inv_pdf = 2 / ((rises / c->length + turns / (IMP_PI * c->radius)) * d->chance);
    return true;
}

bool imp__bent_any(struct imp__edge_draw *d, struct imp__sight *s,
                   struct imp__bent_found *x)
{
    const struct imp_scene *scene = d->b->tracer->scene;
    struct imp_round round;
    struct imp__tube tube;
    const bool curved = d->item && d->item->kind == IMP_ITEM_ROUND;
    if (curved && imp__moves_cylinder(scene, d->item->shape, d->item->place, &tube)) {
        bool wall;
        return imp__edge_tube_part(d, &tube, &wall) &&
               (wall ? wall_reach(d, &tube, s, x) : edge_reach(d, s, x));
    }
    if (!curved || !imp__moves_sphere(scene, d->item->shape, d->item->place, &round))
        return imp__edge_any(d, d->eye, d->b->parallel) && edge_reach(d, s, x);
    const double u[2] = {d->u, imp__u01(d->key, IMP_EDGE_DIR_U)};
    x->dims = 0;
    x->goal = (struct imp__bent_goal){
        .p = round.centre, .across = imp__uniform_sphere(u), .radius = round.radius};
    if (!root_reach(d, s, x)) return false;
    d->out = (x->root.p - round.centre) * (1 / round.radius);
    d->p = x->root.p;
    d->along = imp__normalize(x->root.along);
    d->inv_pdf = IMP_PI * round.radius / d->chance;
    return true;
}

int imp__edge_limb(const struct imp__edge_draw *d, imp_v3 m, imp_spec *R)
{
    const struct imp_scene *scene = d->b->tracer->scene;
    if (imp_likely(!d->b->bends) || d->edge || d->rim || !d->item ||
        d->item->kind != IMP_ITEM_ROUND)
        return 0;
    struct imp_hit hit = {.shape = d->item->shape, .place = d->item->place};
    struct imp_surface at;
    if (!imp__mirror_lobes(imp__hit_bsdf(scene, &hit))) return 0;
    const struct imp__bent_surface s = {
        .q = d->p, .shape = hit.shape, .place = hit.place};
    *R = imp__spec(0);
    if (surface_met(d, &s, d->out, &hit, &at))
        *R = imp__edge_reflected(d, &hit, &at,
                                 imp__cross(d->along, d->out) - d->out * IMP_GRAZING);
    return imp__dot(m, d->out) > 0 ? -1 : 1;
}
