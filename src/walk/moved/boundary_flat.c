/* SPDX-License-Identifier: Apache-2.0
 *
 * Rays from the eye to a place within flat glass (boundary_bent.c): a plane bends them, and then other planes
 * of the same shape reflect them, m times. The edges of a block of glass are seen so. As beyond flat mirrors
 * the place is looked for where its image is: with the eye and the image h_1 and h_2 off the plane, on its two
 * sides, and L apart along it, a ray meets the plane x from the eye's foot where
 *
 *     n_1 x/sqrt(h_1^2 + x^2) = n_2 (L - x)/sqrt(h_2^2 + (L - x)^2).
 *
 * The left side rises with x, the right one falls, and there is one root between 0 and L. */
#include "bent_chain.h"
#include "moved_mirror.h"

bool imp__flat_chain(const struct imp__bent_goal *goal, const struct imp__bent_chain *c)
{
    const struct imp__bent_surface *first = &c->at[0];
    if (c->n == 0 || goal->far || goal->radius > 0 || first->radius > 0 ||
        !(first->ratio > 0))
        return false;
    for (int k = 1; k < c->n; k++) {
        const struct imp__bent_surface *s = &c->at[k];
        if (s->shape != first->shape || s->place != first->place || s->radius > 0 ||
            s->ratio > 0)
            return false;
    }
    return true;
}

#define BISECTIONS 60 /* at most: of Newton's method, which they keep in its bracket */

/* x of the above, with n_1 = ratio n_2. */
static double bend_find(double ratio, double h_1, double h_2, double L)
{
    double lo = 0, hi = L, x = L * h_1 / (h_1 + h_2);
    for (int k = 0; k < BISECTIONS; k++) {
        const double y = L - x, a = sqrt(h_1 * h_1 + x * x), b = sqrt(h_2 * h_2 + y * y),
                     miss = ratio * x / a - y / b,
                     slope = ratio * imp__sqr(h_1 / a) / a + imp__sqr(h_2 / b) / b;
        if (miss < 0) lo = x;
        else hi = x;
        const double next = x - miss / slope, before = x;
        x = next > lo && next < hi ? next : 0.5 * (lo + hi);
        if (fabs(x - before) < 1e-15 * L) break;
    }
    return x;
}

/* Where the ray to the image begins, or its direction. False: the two are on one side, or it is not bent. */
static bool from_set(const struct imp__edge_draw *d, const struct imp__bent_surface *s,
                     imp_v3 image, imp_v3 *from)
{
    const double h_2 = imp__dot(s->n, s->p - image); /* on the other side */
    if (d->b->parallel) {
        imp_v3 w;
        if (!imp__bend(s->n, d->eye, s->ratio, &w)) return false;
        const double t = h_2 / imp__dot(s->n, w);
        *from = image + w * t - d->eye * (2 * d->b->size);
        return t < 0;
    }
    const double h_1 = imp__dot(s->n, d->eye - s->p);
    if (!(h_1 * h_2 > 0)) return false;
    const imp_v3 foot = d->eye - s->n * h_1, along = image + s->n * h_2 - foot;
    const double L = imp__length(along), x = bend_find(s->ratio, fabs(h_1), fabs(h_2), L);
    *from = imp__normalize(foot + (L > 0 ? along * (x / L) : along) - d->eye);
    return true;
}

/* ---- Draws ------------------------------------------------------------------------------- */

enum { WHICH_PLANE, WHICH_SIDE, HOW_MANY, INSIDE };
#define LOOKED_AT 64   /* planes at most: of more, any is drawn */
#define OUTSIDE   0.9  /* of draws, the eye is outside of the glass */
#define APART     1e-6 /* of the scene's size: places that are nearer lie in a plane */

static double height(const struct imp__bent_surface *s, imp_v3 p)
{
    return imp__dot(s->n, p - s->p);
}

/* Which planes may be drawn: those that bend and have the eye on a side, or those that a place is not in. */
struct wanted {
    const struct imp__edge_draw *d;
    double side; /* 1: in front; -1: behind; 0: a place is wanted */
    imp_v3 p;
    size_t but; /* not this one */
};
static bool is_wanted(const struct wanted *w, size_t k)
{
    const struct imp__boundary *b = w->d->b;
    struct imp__bent_surface s;
    const struct imp__plane_range of = imp__plane_surface(b, k, &s);
    if (k == w->but) return false;
    if (w->side == 0) return fabs(height(&s, w->p)) > APART * b->size;
    const double eye = b->parallel ? -imp__dot(s.n, w->d->eye) : height(&s, w->d->eye);
    return of.index > 0 && eye * w->side > 0;
}

/* One of the n planes from `first` on. False: none. */
static bool plane_draw(const struct wanted *w, size_t first, size_t n, double u,
                       double *chance, size_t *plane)
{
    size_t all = 0;
    if (n == 0) return false;
    if (n > LOOKED_AT) {
        *plane = first + imp_min((size_t)(u * (double)n), n - 1);
        *chance /= (double)n;
        return is_wanted(w, *plane);
    }
    for (size_t k = 0; k < n; k++) all += is_wanted(w, first + k);
    size_t left = imp_min((size_t)(u * (double)all), all - 1);
    *chance /= (double)all;
    for (size_t k = 0; k < n && all > 0; k++)
        if (is_wanted(w, first + k) && left-- == 0) {
            *plane = first + k;
            return true;
        }
    return false;
}

/* The planes that reflect, from the place on, and that image of it which the first plane, `entry`, sees. */
static bool inside_draw(const struct imp__edge_draw *d, struct imp_key key,
                        struct imp__plane_range of, size_t entry, int m,
                        struct imp__bent_chain *c, imp_v3 *image, double *chance)
{
    size_t before = SIZE_MAX;
    for (int j = m; j >= 1; j--) {
        const double u = imp__u01(key, INSIDE + (unsigned)j);
        const struct wanted w = {d, 0, *image, m == 1 ? entry : SIZE_MAX};
        size_t k;
        if (j == m) {
            if (!plane_draw(&w, of.first, of.n, u, chance, &k)) return false;
        } else { /* one after the other is not the same */
            if (of.n < 2) return false;
            k = of.first + imp_min((size_t)(u * (double)(of.n - 1)), of.n - 2);
            k += k >= before;
            *chance /= (double)(of.n - 1);
        }
        imp__plane_surface(d->b, k, &c->at[j]);
        *image = imp__mirror_image(c->at[j].p, c->at[j].n, *image);
        before = k;
    }
    return before != entry;
}

bool imp__flat_draw(const struct imp__edge_draw *d, struct imp_key key,
                    const struct imp__bent_goal *goal, struct imp__bent_root *x,
                    double *draws)
{
    const struct imp__boundary *b = d->b;
    const int depth = b->tracer->integrator->max_depth,
              longest = depth < 0 ? IMP_SIGHT_MAX : imp_min(depth - 1, IMP_SIGHT_MAX);
    const bool outside = imp__u01(key, WHICH_SIDE) < OUTSIDE;
    const struct wanted w = {d, outside ? 1 : -1, {0}, SIZE_MAX};
    struct imp__bent_surface *first = &x->chain.at[0];
    double chance = outside ? OUTSIDE : 1 - OUTSIDE;
    imp_v3 image = goal->p;
    size_t k;
    if (longest < 1 ||
        !plane_draw(&w, 0, b->n_planes, imp__u01(key, WHICH_PLANE), &chance, &k))
        return false;
    const struct imp__plane_range of = imp__plane_surface(b, k, first);
    first->ratio = outside ? 1 / of.index : of.index;
    const int m = imp__inside_draw(imp__u01(key, HOW_MANY), longest - 1, &chance);
    x->chain.n = 1 + m;
    if (!inside_draw(d, key, of, k, m, &x->chain, &image, &chance) ||
        fabs(height(first, image)) < APART * b->size)
        return false;
    *draws = 1 / chance;
    return from_set(d, first, image, &x->from) && imp__bent_find(d, goal, x);
}
