/* SPDX-License-Identifier: Apache-2.0
 *
 * Mirrors and clear glass between points of a chain (moved.h): a smooth metal, the coat of plastic, a pane,
 * a ball of glass. A ray along w leaves a mirror of normal n along  S w = w - 2 n (n.w),  which is no
 * constant where the ray or the mirror turns:
 *
 *     w_o' = S w' - 2 [n' (n.w) + n (n'.w)]
 *     d ln F = (d ln F/dc) c',  c = -n.w
 *
 * with F(c) what it reflects. Glass bends it, with r the index of refraction on the side from which it
 * comes, over that of the other one, n against w and  c_t = sqrt(1 - r^2 (1 - c^2)):
 *
 *     w_o = r w + (r c - c_t) n
 *     w_o' = r w' + (r c - c_t) n' + (r - r^2 c/c_t) c' n,  c' = -(n'.w + n.w')
 *
 * On a sphere n turns as the ray slides over it. Beyond a flat mirror, things are seen where their images
 * are: of a place y
 *
 *     S y = y - 2 n n.(y - q),  (S y)' = S y' - 2 [n' n.(y - q) + n n'.(y - q) - n n.q']
 *
 * q a point of the mirror. Images are as far away, and turn lengths and angles into the same ones: an
 * edge seen in a mirror is an edge, seen from an image of where it is seen from.  Panes also let light
 * straight on, by a part that changes with c likewise. */
#ifndef IMP_WALK_MOVED_MIRROR_H
#define IMP_WALK_MOVED_MIRROR_H

#include "moved_chain.h"

/* Does light leave this vertex as from a mirror? */
static inline bool imp__is_mirrored(const struct imp_vertex *v)
{
    const int lobe = v->d.lobe;
    return v->bsdf && v->d.goes_on && lobe >= 0 && lobe < 64 &&
           !(v->bsdf->straight >> lobe & 1);
}
/* Delta lobes that do not go straight on; where walks have derivatives, mirrors. */
static inline uint64_t imp__mirror_lobes(const struct imp_bsdf *b)
{
    const int n = b->n_lobes > 0 ? b->n_lobes : 8;
    if (imp_likely(!(b->flags & IMP_BSDF_DELTA))) return 0;
    return (n < 64 ? (UINT64_C(1) << n) - 1 : ~UINT64_C(0)) & ~b->straight;
}
/* Do all its delta lobes reflect, or go straight on? */
bool imp__bends_nothing(const struct imp_bsdf *b);
/* Clear glass: its first lobe reflects, its second one bends. */
#define IMP_GLASS_REFLECTS 0
#define IMP_GLASS_BENDS    1
bool imp__is_glass(const struct imp_bsdf *b);
/* Does it let light straight on by a part that depends on the angle? */
bool imp__passes_by_angle(const struct imp_bsdf *b);

static inline imp_v3 imp__mirror_turn(imp_v3 n, imp_v3 w)
{
    return w - n * (2 * imp__dot(n, w));
}
/* Where a ray along the unit vector w goes at a surface of normal n, of either side. ratio: r of glass that
 * bends it; 0: it is reflected. False: r bends none that is so flat. */
static inline bool imp__bend(imp_v3 n, imp_v3 w, double ratio, imp_v3 *out)
{
    const double along = imp__dot(n, w), c = fabs(along),
                 square = 1 - ratio * ratio * (1 - c * c);
    *out = imp__mirror_turn(n, w);
    if (ratio == 0) return true;
    if (!(square > 0)) return false;
    *out = w * ratio - n * ((along > 0 ? 1 : -1) * (ratio * c - sqrt(square)));
    return true;
}
/* An adjoint of that direction, of the side of n that faces the ray, or of mirrors of any: what it is to w,
 * across it, which is returned, and to n, which is added. */
static inline imp_v3 imp__bend_bar(imp_v3 n, imp_v3 w, double ratio, imp_v3 bar,
                                   imp_v3 *n_bar)
{
    if (ratio == 0) {
        *n_bar -= (bar * imp__dot(n, w) + w * imp__dot(n, bar)) * 2;
        return imp__mirror_turn(n, bar);
    }
    const double side = imp__dot(n, w) > 0 ? -1 : 1, c = -side * imp__dot(n, w),
                 square = 1 - ratio * ratio * (1 - c * c);
    if (!(square > 0)) return (imp_v3){0}; /* as far as places that are rounded tell */
    const double cos_t = sqrt(square),
                 by_c = side * imp__dot(n, bar) * (ratio - ratio * ratio * c / cos_t);
    *n_bar += bar * (side * (ratio * c - cos_t)) - w * (side * by_c);
    const imp_v3 w_bar = bar * ratio - n * (side * by_c);
    return w_bar - w * imp__dot(w, w_bar);
}
/* The image of y, and, transposed, what an adjoint of its velocity is to that of y, which is
 * returned, and to the mirror's point q and normal n, which are added to *mirror. */
static inline imp_v3 imp__mirror_image(imp_v3 q, imp_v3 n, imp_v3 y)
{
    return y - n * (2 * imp__dot(n, y - q));
}
static inline imp_v3 imp__mirror_image_bar(imp_v3 q, imp_v3 n, imp_v3 y, imp_v3 bar,
                                           struct imp__velocity *mirror)
{
    const double apart = imp__dot(n, y - q), along = imp__dot(n, bar);
    mirror->n -= (bar * apart + (y - q) * along) * 2;
    mirror->v += n * (2 * along);
    return imp__mirror_turn(n, bar);
}

/* At a vertex whose lobe is a delta: an adjoint of the logarithm of what it reflects, or lets straight
 * on, of light that the ray from `from` carries. Texture lookups slide. */
void imp__lobe_bar(const struct imp_scene *scene, const struct imp_vertex *v, double time,
                   imp_v3 from, imp_spec bar, struct imp__link_point *x);
/* At a mirror or glass that is seen from `from`: an adjoint of the direction in which the ray leaves it. */
void imp__bend_turn_bar(imp_v3 from, imp_v3 turn, double ratio,
                        struct imp__link_point *x);
/* r of a vertex, as imp__bend has it. */
double imp__vertex_ratio(const struct imp_vertex *v);

#endif
