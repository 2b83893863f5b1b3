/* SPDX-License-Identifier: Apache-2.0
 *
 * The importance of a node of the tree of lights at places, a text in lanes (math/lane_text.h). With d
 * the way from the place p to the box's centre and r its half diagonal, a and b the half extents of
 * the box along the place's normal n and the node's axis,
 *
 *   I = g S <cos theta'> <cos theta_i> / max(d^2, r^2)
 *   <cos theta_i> = <d.n + [-a, a]> / |d|,   <cos theta'> = <cos x + [-b, b]/|d|>,
 *
 * <[.]> the mean of the positive part, x the least angle between the way and the cone of normals
 * (light_tree.h). Cosines count where the place is outside of the box's sphere. */

/* Mean of max(0, x) where x lies evenly in [m - e, m + e]. */
static inline real WIDE(imp__mean_positive)(real m, real e)
{
    const real zero = number(0), both = m + e;
    return choose(m >= e, m, choose(m <= -e, zero, both * both / (4 * e)));
}

/* Cosine and sine of max(0, a - b), of angles within [0, pi]. */
static inline real WIDE(imp__cos_less)(real sin_a, real cos_a, real sin_b, real cos_b)
{
    return choose(cos_a > cos_b, number(1), cos_a * cos_b + sin_a * sin_b);
}
static inline real WIDE(imp__sin_less)(real sin_a, real cos_a, real sin_b, real cos_b)
{
    return choose(cos_a > cos_b, number(0), sin_a * cos_b - cos_a * sin_b);
}

static inline real WIDE(imp__cosine_within)(real x)
{
    return larger(lesser(x, number(1)), number(IMP_LIGHT_SLACK));
}

/* faces: what arrives from behind counts for nothing. *near: the place is so near that the node's
 * box hardly bounds where its lights are. */
static inline real WIDE(imp__light_importance)(const struct imp_light_node *n,
                                               const real place[3], const real normal[3],
                                               bool faces, truth *near)
{
    const real zero = number(0), one = number(1);
    real d2 = zero, front = zero, depth = zero, axis = zero;
    double r2 = 0, along = 0;
    for (int k = 0; k < 3; k++) {
        const double half = 0.5 * ((double)n->hi[k] - n->lo[k]);
        const real d = number(0.5 * ((double)n->lo[k] + n->hi[k])) - place[k];
        d2 += d * d;
        r2 += half * half;
        front += d * normal[k];
        depth += half * magnitude(normal[k]);
        axis -= d * (double)n->axis[k];
        along += half * fabs((double)n->axis[k]);
    }
    *near = d2 < number(IMP_LIGHT_NEAR2 * r2);
    const truth outside = d2 > number(r2);
    real out =
        (double)(n->strength * n->gain) / larger(larger(d2, number(r2)), number(1e-60));
    const real inverse = choose(d2 > zero, 1 / root_of(d2), zero);
    truth dark = d2 < zero;
    if (faces) {
        const real cosine = WIDE(imp__mean_positive)(front, depth) * inverse;
        dark |= front <= -(1 + IMP_LIGHT_SLACK) * depth;
        out *= choose(outside, WIDE(imp__cosine_within)(cosine), one);
    }
    if (n->cos_normals > -1) {
        const real cos_w = larger(lesser(axis * inverse, one), number(-1)),
                   sin_w = root_of(larger(zero, 1 - cos_w * cos_w));
        const double cos_of = n->cos_normals;
        const real cos_o = number(cos_of),
                   sin_o = number(sqrt(imp_max(0.0, 1 - cos_of * cos_of)));
        const real sin2_b = r2 / d2, sin_b = root_of(sin2_b), cos_b = root_of(1 - sin2_b);
        const real cos_x = WIDE(imp__cos_less)(sin_w, cos_w, sin_o, cos_o),
                   sin_x = WIDE(imp__sin_less)(sin_w, cos_w, sin_o, cos_o);
        dark |= outside & (WIDE(imp__cos_less)(sin_x, cos_x, sin_b, cos_b) <
                           number(n->cos_reach - IMP_LIGHT_SLACK));
        if (n->cos_reach < 1)
            out *= choose(outside,
                          WIDE(imp__cosine_within)(
                              WIDE(imp__mean_positive)(cos_x, along * inverse)),
                          one);
    }
    return choose(dark, zero, out);
}
