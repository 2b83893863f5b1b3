/* SPDX-License-Identifier: Apache-2.0
 *
 * Normals where D changes (microfacet_score.c), a text in lanes (math/lane_text.h): their share of what is
 * drawn (imp__score_share), and the density of GGX's normals (mx, my, z). */

static inline real WIDE(imp__facets_share)(real au, real av)
{
    const real x = (0.2 - root_of(au * av)) / 0.1;
    return 0.25 * larger(lesser(x, number(1)), number(0));
}

static inline real WIDE(imp__ggx_score_pdf)(real au, real av, real mx, real my, real z,
                                            real D, unsigned wanted)
{
    const real x = mx / au, y = my / av;
    const real s = 1 / (x * x + y * y + z * z), vx = x * x * s, vy = y * y * s;
    real sum = number(0);
    if (wanted & IMP_SCORE_SCALE)
        sum += magnitude(2 * (vx + vy) - 1) / IMP_GGX_SCORE_SCALE;
    if (wanted & IMP_SCORE_U) sum += magnitude(4 * vx - 1) / IMP_GGX_SCORE_AU;
    if (wanted & IMP_SCORE_V) sum += magnitude(4 * vy - 1) / IMP_GGX_SCORE_AU;
    if (wanted & IMP_SCORE_ASPECT) sum += 2 * magnitude(vx - vy) / IMP_GGX_SCORE_ASPECT;
    return choose(z > 0, D * z * sum / __builtin_popcount(wanted), number(0));
}
