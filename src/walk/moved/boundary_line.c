/* SPDX-License-Identifier: Apache-2.0
 *
 * Straight lines between the points of a draw (boundary.h): masks let a part of the light pass, null
 * materials all of it. What passes is a factor, and moves no point behind it. */
#include "boundary_one_sided.h"
#include "moved_mirror.h"
#include "walk/media/media_along.h"
#include "walk/media/tracking.h"

#define PASSES_MOST 1024 /* surfaces on a line: of more, nothing comes through */

/* What goes straight on through a surface, along the unit vector w. */
static imp_spec passed(const struct imp__edge_draw *d, const struct imp_bsdf *b,
                       const struct imp_hit *hit, const struct imp_surface *at, imp_v3 w)
{
    const struct imp_scene *scene = d->b->tracer->scene;
    const struct imp_shape *shape =
        scene->shapes[imp__placed_shape(scene, hit->shape, hit->place)];
    const struct imp_frame frame = {at->s, at->t, at->n};
    const imp_v3 wi = imp__to_local(&frame, w);
    const struct imp_texcoord place = {.uv = {at->uv[0], at->uv[1]},
                                       .p = at->p,
                                       .shape = shape,
                                       .prim = hit->prim,
                                       .carried = imp__edge_waves(d)};
    imp_spec in[IMP_INPUTS_MAX], f, sum = {0};
    imp__evaluate_inputs(b, shape, &place, in);
    for (int l = 0; l < 64; l++) {
        if (!(b->straight >> l & 1)) continue;
        const struct imp_dirs dirs = {-wi, wi, l, 0};
        imp__bsdf_eval(b, place.carried, in, &dirs, &f);
        sum += f;
    }
    return sum;
}

static bool is_open(const struct imp__edge_draw *d, imp_v3 o, imp_v3 r, double till,
                    struct imp__line *line)
{
    const struct imp_scene *scene = d->b->tracer->scene;
    if (imp_likely(!d->b->passes))
        return !imp__occluded_at(scene, d->time, &o, &r, 0, till);
    const imp_v3 end = o + r * till;
    for (int n = 0; n < PASSES_MOST; n++) {
        struct imp_hit hit;
        struct imp_surface at;
        const double reach = isfinite(till) ? 1 : INFINITY;
        const imp_v3 way = isfinite(till) ? end - o : r;
        if (!imp__intersect_at(scene, d->time, &o, &way, 0, reach, &hit)) return true;
        const struct imp_bsdf *b = imp__hit_bsdf(scene, &hit);
        if (!b->straight) return false;
        imp__hit_surface(scene, &hit, &o, &way, &at);
        line->T *= passed(d, b, &hit, &at, imp__normalize(way));
        line->bounces += !d->b->through;
        o = imp__offset(at.p, at.ng, r);
        if (imp__is_zero_used(line->T, d->waves)) return false;
        if (isfinite(till) && !(imp__dot(end - o, r) > 0)) return true;
    }
    return false;
}

double imp__edge_clip(const struct imp__edge_draw *d, const struct imp_sensor_sample *to)
{
    const struct imp_sensor *s = d->b->tracer->sensor;
    struct imp_sensor_ray ray;
    s->ops->ray(s, to->px, to->py, d->lens, &ray);
    return ray.t_near;
}

bool imp__edge_hit_passes(const struct imp__edge_draw *d, const struct imp_hit *hit,
                          imp_v3 o, imp_v3 r, imp_spec *T)
{
    const struct imp_bsdf *b = imp__hit_bsdf(d->b->tracer->scene, hit);
    struct imp_surface at;
    if (imp_likely(!b->straight)) return false;
    imp__hit_surface(d->b->tracer->scene, hit, &o, &r, &at);
    *T *= passed(d, b, hit, &at, imp__normalize(r));
    return true;
}

bool imp__edge_line(const struct imp__edge_draw *d, imp_v3 o, imp_v3 r, double till,
                    struct imp__line *line)
{
    const double length = imp__length(r);
    *line = (struct imp__line){
        .T = imp__edge_cleared(d, o, r * (1 / length), length * till), .times = 1};
    return !imp__is_zero_used(line->T, d->waves) && is_open(d, o, r, till, line);
}

/* How far light goes in media before it is scattered: by the extinction of a lane that is chosen
 * (Wilkie et al. 2014) or, since what it brings to a camera nearby is one over a distance squared, by
 * the angle under which that sees it (Kulla and Fajardo 2012). One chance is as good as the other. A
 * distance by the angle may lie where nothing scatters; then the line brings nothing. */
struct flight {
    imp_v3 o, w;
    bool aims;
    double nearest, apart,
        first; /* the eye: along the line, off it; angle where it begins */
    const struct imp_medium *medium; /* of the next stretch */
    double aimed;                    /* by the angle; INFINITY: not chosen so */
    int lane;                        /* of `depth` */
    double depth;                    /* optical, that is left; INFINITY: not chosen so */
    double gone;                     /* length so far */
    imp_spec T;                      /* what the media let pass of that */
};

static struct flight flight_of(const struct imp__edge_draw *d, imp_v3 o, imp_v3 w,
                               double from, unsigned dims)
{
    struct flight f = {.o = o,
                       .w = w,
                       .aims = !d->b->parallel,
                       .aimed = INFINITY,
                       .depth = INFINITY,
                       .T = imp__spec(1)};
    f.medium = imp__edge_medium(d, o + w * from, w);
    const imp_v3 r = d->eye - o;
    const int lanes = d->b->tracer->scene->lanes;
    const unsigned first = IMP_EDGE_FLIGHT + 2 * dims;
    double u = imp__u01(d->key, first);
    const double v = imp__u01(d->key, first + 1);
    if (f.aims) {
        f.nearest = imp__dot(r, w);
        f.apart = imp_max(imp__length(r - w * f.nearest), 1e-6 * d->b->size);
        f.first = atan(-f.nearest / f.apart);
    }
    if (f.aims && u < 0.5) {
        f.aimed =
            imp_max(f.nearest + f.apart * tan(f.first + v * (IMP_PI / 2 - f.first)), 0.0);
        return f;
    }
    if (f.aims) u = 2 * u - 1;
    f.lane = imp_min((int)(u * lanes), lanes - 1);
    f.depth = -log(1 - v);
    return f;
}

enum flown { FLOWN_THROUGH, FLOWN_SCATTERED, FLOWN_LOST };

/* The same in a medium that varies. */
static enum flown varying_on(const struct imp__edge_draw *d, struct flight *f,
                             double till)
{
    const struct imp_medium *m = f->medium;
    double far = till;
    if (f->aimed < till) far = f->aimed;
    else if (!(f->aimed < INFINITY))
        far =
            imp_min(till, imp__along_until(d->b->tracer->scene, m, f->o, f->w, f->gone,
                                           till, imp__edge_waves(d), f->lane, &f->depth));
    f->T *= imp__edge_fading(d, m, f->o, f->w, f->gone, far);
    f->gone = far;
    if (!(far < till)) return FLOWN_THROUGH;
    return imp__is_zero_used(imp__edge_extinction(d, m, f->o + f->w * far), d->waves)
               ? FLOWN_LOST
               : FLOWN_SCATTERED;
}

/* On to this length, or to where light is scattered before, f->gone then. */
static enum flown flight_on(const struct imp__edge_draw *d, struct flight *f, double till)
{
    if (f->medium && f->medium->majorants) return varying_on(d, f, till);
    const imp_spec sigma = imp__edge_extinction(d, f->medium, f->o);
    const double mine = sigma[f->lane],
                 far = f->aimed < till ? f->aimed
                       : mine > 0      ? imp_min(till, f->gone + f->depth / mine)
                                       : till;
    f->T *= imp__attenuation(sigma, imp_max(far - f->gone, 0.0));
    if (far < till) {
        f->gone = far;
        return imp__is_zero_used(sigma, d->waves) ? FLOWN_LOST : FLOWN_SCATTERED;
    }
    f->depth = mine > 0 ? f->depth - (till - f->gone) * mine : f->depth;
    f->gone = till;
    return FLOWN_THROUGH;
}

/* The line ends after this length, on a surface or in a medium: what passes, and the density. */
static void flight_end(const struct imp__edge_draw *d, const struct flight *f,
                       double length, bool floats, struct imp__line *line)
{
    const int lanes = d->b->tracer->scene->lanes;
    const imp_spec sigma =
        floats ? imp__edge_extinction(d, f->medium, f->o + f->w * length) : imp__spec(1);
    double p = imp__sum_used(sigma * f->T, lanes) / lanes;
    if (f->aims) {
        const double x = (length - f->nearest) / f->apart, all = IMP_PI / 2 - f->first;
        const double aimed =
            floats ? 1 / (f->apart * (1 + x * x) * all) : (IMP_PI / 2 - atan(x)) / all;
        p = 0.5 * (p + aimed);
    }
    line->T *= f->T;
    line->times *= 1 / p;
}

#define PASS_LEAST   0.1 /* probability of either choice at a mask */
#define MIRRORS_SURE 4   /* behind so many mirrors, a line goes on by what it carries */

/* A mirror is met, of what it reflects, or glass, of what it lets through and bends by this ratio: *start is
 * the image of where the line began, or a place that is as far away. */
static bool turn(struct imp__edge_draw *d, const struct imp_hit *hit,
                 const struct imp_surface *at, double ratio, imp_spec F, imp_v3 *start,
                 struct imp__line *line)
{
    if (!imp__mirror_add(d, &line->mirrors, hit, at)) return false;
    struct imp__mirror *m = line->mirrors.last;
    const struct imp__glued *x = &m->x;
    if (!imp__bend(x->n, line->w, ratio, &line->w)) return false;
    m->ratio = ratio > 0 ? 1 / ratio : 0;
    if (imp_likely(x->curvature == 0 && ratio == 0)) {
        *start = imp__mirror_image(x->p, x->n, *start);
    } else {
        *start = at->p - line->w * hit->t;
        line->mirrors.bends = true;
    }
    if (line->mirrors.n == 1) {
        line->T_mirrored = imp__spec(1);
        line->bounces_mirrored = 0;
    }
    line->T *= F;
    line->T_mirrored *= F;
    line->bounces++;
    line->bounces_mirrored++;
    return true;
}

/* Probabilities with which a line goes straight on, is reflected, or is bent, at a surface. Behind many perfect
 * mirrors what it carries over these never becomes more than 1, so that its square has a mean. */
struct fates {
    double pass, reflect, bend;
};
static struct fates fates_of(const struct imp__edge_draw *d, const struct imp_bsdf *b,
                             imp_spec T, imp_spec F, imp_spec G,
                             const struct imp__line *line)
{
    struct fates out = {0, 0, 0};
    const double t = imp__max_used(T, d->waves), r = imp__max_used(F, d->waves),
                 g = imp__max_used(G, d->waves);
    if (b->flags & IMP_BSDF_SMOOTH) {
        if (b->straight) out.pass = imp_clamp(t, PASS_LEAST, 1 - PASS_LEAST);
        if (r > 0)
            out.reflect = imp_clamp(r, PASS_LEAST, 1 - PASS_LEAST) * (1 - out.pass);
        return out;
    }
    const double left = imp__max_used(line->T * (T + F + G), d->waves) * line->times,
                 go = line->mirrors.n < MIRRORS_SURE ? 1 : imp_min(left, 1.0);
    if (imp_unlikely(g > 0)) {
        out.reflect = r > 0 ? imp_clamp(r / (r + g), PASS_LEAST, 1 - PASS_LEAST) * go : 0;
        out.bend = go - out.reflect;
        return out;
    }
    if (!(r > 0)) {
        out.pass = b->straight ? 1 : 0;
        return out;
    }
    if (b->straight) out.pass = imp_clamp(t / (t + r), PASS_LEAST, 1 - PASS_LEAST) * go;
    out.reflect = go - out.pass;
    return out;
}

bool imp__edge_follow(struct imp__edge_draw *d, imp_v3 o, imp_v3 w, double from,
                      unsigned dims, struct imp_hit *hit, struct imp_surface *at,
                      struct imp__line *line)
{
    const struct imp_scene *scene = d->b->tracer->scene;
    imp_v3 start = o;
    struct flight f;
    const bool fades = imp__edge_fades(d);
    const int longest = d->b->tracer->integrator->max_depth;
    *line = (struct imp__line){.T = imp__spec(1), .times = 1, .w = w};
    if (imp_unlikely(d->b->one_sided))
        return imp__one_sided_follow(d, o, w, from, IMP_EDGE_PASS + dims * PASSES_MOST,
                                     hit, at, line);
    if (imp_unlikely(fades)) f = flight_of(d, o, w, from, dims);
    for (unsigned n = 0; n < PASSES_MOST; n++) {
        const bool meets = imp__intersect_at(scene, d->time, &o, &w, from, INFINITY, hit);
        if (meets) imp__hit_surface(scene, hit, &o, &w, at);
        if (imp_unlikely(n > 0) && meets) hit->t = imp__dot(at->p - start, w);
        if (imp_unlikely(fades)) {
            const enum flown flown = flight_on(d, &f, meets ? hit->t : INFINITY);
            if (flown == FLOWN_LOST) return false;
            if (flown == FLOWN_SCATTERED) {
                *hit =
                    (struct imp_hit){.shape = -1, .prim = f.medium->index, .t = f.gone};
                *at = (struct imp_surface){.p = start + w * f.gone};
                flight_end(d, &f, f.gone, true, line);
                return true;
            }
        }
        if (!meets) return false;
        const struct imp_bsdf *b = imp__hit_bsdf(scene, hit);
        const bool mirrors = imp__mirror_lobes(b) != 0;
        struct fates fate = {0, 0, 0};
        imp_spec T = {0}, F = {0}, G = {0};
        double u = 1, ratio = 0;
        if (imp_unlikely(b->straight || mirrors)) {
            if (b->straight) T = passed(d, b, hit, at, w);
            if (mirrors) F = imp__edge_reflected(d, hit, at, w);
            if (mirrors) G = imp__edge_refracted(d, hit, at, w, &ratio);
            fate = fates_of(d, b, T, F, G, line);
            u = imp__u01(d->key, IMP_EDGE_PASS + dims * PASSES_MOST + n);
        }
        if (u >= fate.pass + fate.reflect + fate.bend) {
            if (mirrors && !(b->flags & IMP_BSDF_SMOOTH)) return false;
            line->times *= 1 / (1 - fate.pass - fate.reflect);
            if (imp_unlikely(fades)) flight_end(d, &f, hit->t, false, line);
            return true;
        }
        const bool passes = u < fate.pass, bends = u >= fate.pass + fate.reflect;
        line->times *= 1 / (passes ? fate.pass : bends ? fate.bend : fate.reflect);
        if (passes) {
            line->T *= T;
            line->T_mirrored *= T;
            line->bounces += !d->b->through;
            line->bounces_mirrored += !d->b->through;
        } else {
            if (!turn(d, hit, at, bends ? ratio : 0, bends ? G : F, &start, line) ||
                (longest >= 0 && line->bounces >= longest))
                return false;
            w = line->w;
        }
        if (imp__is_zero_used(line->T, d->waves)) return false;
        if (imp_unlikely(d->b->media))
            f.medium = imp__medium_beyond(scene->shapes[hit->shape], at->ng, w, f.medium);
        o = imp__offset(at->p, at->ng, w);
        from = 0;
    }
    return false;
}

#define CURVED                                                                           \
    4 /* IMP_SHORT_OF of a curved shape, per root of that and the scene's size */

imp_spec imp__edge_near(struct imp__edge_draw *d, imp_v3 w, double distance, double apart,
                        imp_spec T)
{
    double shorter = IMP_SHORT_OF * apart;
    d->near = 0;
    if (imp_likely(!imp__edge_fades(d))) return imp__spec(1);
    /* A ray that passes a sphere's silhouette inside meets it sqrt(2 r apart) before. */
    if (!d->edge && d->item->kind <= IMP_ITEM_ARC) {
        shorter = imp_max(shorter, CURVED * sqrt(d->b->size * apart));
        shorter = imp_min(shorter, distance);
        T *= imp__edge_uncleared(d, d->p - w * shorter, w, shorter);
    }
    d->near = imp_max(distance - shorter, 0.0);
    return T;
}

bool imp__edge_passes(const struct imp__edge_draw *d)
{
    const struct imp_scene *scene = d->b->tracer->scene;
    const struct imp__edges *edges = d->edges;
    struct imp_hit own = {.shape = -1};
    if (imp_likely(!d->b->passes)) return false;
    if (!d->edge) {
        if (d->item->shape < 0) return false;
        own.shape = d->item->shape;
        own.place = d->item->place;
        return imp__hit_bsdf(scene, &own)->straight;
    }
    for (int k = 0; k < d->edge->n_faces; k++) {
        own.shape = edges->face[d->edge->first + (size_t)k].shape;
        own.place = edges->face[d->edge->first + (size_t)k].place;
        if (imp__hit_bsdf(scene, &own)->straight) return true;
    }
    return false;
}
