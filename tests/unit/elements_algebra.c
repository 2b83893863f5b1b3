/* SPDX-License-Identifier: Apache-2.0
 *
 * The pieces of the finite elements against closed forms: form factors, basis, materials.
 */
#include "elements/elements.h"
#include "imp_tap.h"
#include "math/quadrature.h"
#include "math/rng.h"

/* ---- Form factors -------------------------------------------------------------- */

static double square_to_square(int n, const imp_v3 origin, imp_v3 u, imp_v3 v,
                               imp_v3 normal, const imp_v3 other[4], imp_v3 facing)
{
    double x[16], w[16], sum = 0;
    imp__gauss_legendre((size_t)n, 0, 1, x, w);
    for (int i = 0; i < n; i++)
        for (int j = 0; j < n; j++)
            sum += w[i] * w[j] *
                   imp__polygon_factor(origin + u * x[i] + v * x[j], normal, 4, other,
                                       facing);
    return sum / IMP_PI;
}

static void form_factors(void)
{
    const imp_v3 ex = imp__v3(1, 0, 0), ey = imp__v3(0, 1, 0), ez = imp__v3(0, 0, 1),
                 o = {0};
    const imp_v3 opposed[4] = {ez, ez + ex, ez + ex + ey, ez + ey};
    const imp_v3 side[4] = {o, ey, ey + ez, ez}; /* at x = 0, faces +x */
    const double par = square_to_square(8, o, ex, ey, ez, opposed, -ez);
    const double perp = square_to_square(8, o, ex, ey, ez, side, ex);
    tap_near(par, 0.19982489569838746, 1e-10, 0, "opposed unit squares");
    tap_near(perp, 0.20004377607540316, 1e-10, 0, "perpendicular unit squares");
    tap_near(square_to_square(4, o, ex, ey, ez, opposed, -ez), par, 1e-5, 0,
             "with 4 x 4 nodes");

    /* A point below the centre of a unit square at distance 1; Siegel and Howell's corner
     * formula gives four times (1/2 pi)(a atan(b)/... ), evaluated to 15 digits. */
    const imp_v3 x = imp__v3(0.5, 0.5, 0);
    const double a = 0.5, c = 1 / sqrt(1 + a * a);
    const double corner = 2 * a * c * atan(a * c) / IMP_2PI;
    tap_near(imp__polygon_factor(x, ez, 4, opposed, -ez) / IMP_PI, 4 * corner, 1e-12, 0,
             "point to polygon in closed form");
    tap_near(4 * corner, 0.2394564705, 1e-9, 0, "the published number");

    /* A box seen from a point of its floor: everything that is seen adds up to 1. */
    struct imp_key key = imp__key(5, 0, 0);
    double worst = 0;
    for (uint32_t k = 0; k < 1000; k++) {
        const imp_v3 p = imp__v3(imp__u01(key, 2 * k), imp__u01(key, 2 * k + 1), 0);
        const imp_v3 wall[4][4] = {{o, ey, ey + ez, ez},
                                   {ex, ex + ez, ex + ey + ez, ex + ey},
                                   {o, ez, ez + ex, ex},
                                   {ey, ey + ex, ey + ex + ez, ey + ez}};
        const imp_v3 facing[4] = {ex, -ex, ey, -ey};
        double sum = imp__polygon_factor(p, ez, 4, opposed, -ez);
        for (int i = 0; i < 4; i++)
            sum += imp__polygon_factor(p, ez, 4, wall[i], facing[i]);
        worst = fmax(worst, fabs(sum / IMP_PI - 1));
    }
    tap_ok(worst < 1e-12, "form factors of a closed box add up to 1 # worst %.2e", worst);

    /* A disk-like polygon cannot be had; a triangle cut by the horizon can: half of what
     * the whole, mirrored below, would give. */
    const imp_v3 t[3] = {imp__v3(2, -1, -1), imp__v3(2, 1, -1), imp__v3(2, 0, 1)};
    double sum = 0, nodes[40], weights[40];
    imp__gauss_legendre(40, 0, 1, nodes, weights);
    for (int i = 0; i < 40;
         i++) /* upper part: a triangle with base at z = 0 of half-width 1/2 */
        for (int j = 0; j < 40; j++) {
            const double z = nodes[i], half = 0.5 * (1 - z);
            const imp_v3 y = imp__v3(2, half * (2 * nodes[j] - 1), z);
            const double r2 = imp__dot(y, y);
            sum +=
                weights[i] * weights[j] * 2 * half * (z / sqrt(r2)) * (2 / sqrt(r2)) / r2;
        }
    tap_near(imp__polygon_factor(o, ez, 3, t, -ex), sum, 1e-12, 0,
             "clipped at the horizon");
    tap_ok(imp__polygon_factor(o, ez, 3, t, ex) == 0, "nothing from behind");
    const imp_v3 flat[4] = {-ex - ey, ex - ey, ex + ey, ey - ex};
    tap_ok(imp__polygon_factor(o, ez, 4, flat, -ez) == 0 &&
               imp__polygon_factor(imp__v3(0.1, 0.2, 1e-17), ez, 4, flat, -ez) == 0,
           "nothing from a coplanar polygon around the point");
    const imp_v3 sliver[4] = {ez, ez + ex, ez + ex + ey * 1e-13, ez + ey * 1e-13};
    const double thin = imp__polygon_factor(o, ez, 4, sliver, -ez);
    tap_ok(isfinite(thin) && thin < 2e-13, "a sliver is harmless # %.3g", thin);
}

/* ---- Basis --------------------------------------------------------------------- */

static void gram(int order)
{
    struct imp__el_basis b;
    double z[24], w[24], h[EL_N_MAX], worst = 0;
    static double g[EL_N_MAX][EL_N_MAX];
    memset(g, 0, sizeof g);
    imp__basis_init(&b, order);
    imp__gauss_legendre(24, 0, 1, z, w);
    for (int i = 0; i < 24; i++)
        for (int p = 0; p < 48; p++) {
            const double r = sqrt(1 - z[i] * z[i]), phi = IMP_2PI * p / 48;
            imp__basis_eval(&b, imp__v3(r * cos(phi), r * sin(phi), z[i]), h);
            for (int k = 0; k < b.n; k++)
                for (int m = 0; m < b.n; m++)
                    g[k][m] += w[i] * IMP_2PI / 48 * h[k] * h[m];
        }
    for (int k = 0; k < b.n; k++)
        for (int m = 0; m < b.n; m++) worst = fmax(worst, fabs(g[k][m] - (k == m)));
    tap_ok(worst < 1e-12 && b.n == (order + 1) * (order + 2) / 2,
           "order %d: %d functions, Gram matrix is 1 # worst %.2e", order, b.n, worst);
}

/* ---- Materials ----------------------------------------------------------------- */

static void materials(imp_context *ctx)
{
    struct imp_arena a;
    struct imp__el_basis b;
    static struct imp__el_material lambert, phong;
    imp__arena_init(&a, ctx);
    imp__basis_init(&b, 8);

    lambert = (struct imp__el_material){.phong = true, .kd = {0.3, 0.5, 0.7}};
    phong = (struct imp__el_material){
        .phong = true, .kd = {0.1, 0.1, 0.1}, .ks = {0.6, 0.6, 0.6}, .exponent = 15};
    const enum imp_status st = imp__el_project(ctx, &a, &b, 3, "x", &lambert);
    double rest = 0;
    for (int k = 1; k < 25; k++) rest = fmax(rest, fabs(lambert.r[0][k]));
    tap_ok(st == IMP_OK && rest < 1e-14, "Lambert needs one function # rest %.1e", rest);
    for (int c = 0; c < 3; c++)
        tap_near(lambert.r[c][0], 2 * lambert.kd[c], 1e-14, 0, "R_00 = 2 kd");
    tap_ok(imp__el_project(ctx, &a, &b, 1, "x", &phong) == IMP_OK && phong.n == 45,
           "a Phong lobe needs all");

    /* R x for uniform incidence cos: against quadrature of f cos, projected. The lobe is
     * of higher order than the basis, the matrix elements must be exact all the same. */
    double c[EL_N_MAX] = {0}, y[EL_N_MAX], worst = 0, z[96], w[96];
    c[0] = sqrt(IMP_PI / 2);
    imp__el_apply(&b, phong.n, phong.r[0], c, y);
    imp__gauss_legendre(96, 0, 1, z, w);
    double want = 0; /* R_00 = int int f H_0 H_0 */
    for (int o = 0; o < 96; o += 1)
        for (int i = 0; i < 96; i += 1) {
            double f[3], ring = 0;
            const imp_v3 wo = imp__v3(sqrt(1 - z[o] * z[o]), 0, z[o]);
            for (int p = 0; p < 128; p++) {
                const double r = sqrt(1 - z[i] * z[i]), phi = IMP_2PI * p / 128;
                imp__el_brdf(&phong, wo, imp__v3(r * cos(phi), r * sin(phi), z[i]), f);
                ring += f[0] * IMP_2PI / 128;
            }
            want += w[o] * w[i] * ring;
        }
    tap_near(phong.r[0][0], want, 1e-6, 0,
             "R_00 of a Phong lobe against a fine quadrature");
    const double *r = phong.r[0];
    for (int m = 0; m <= 8; m++) {
        const int n = b.size[m];
        for (int k = 0; k < n; k++)
            for (int j = 0; j < n; j++)
                worst = fmax(worst, fabs(r[k * n + j] - r[j * n + k]));
        r += n * n;
    }
    tap_ok(worst == 0, "R is symmetric");
    tap_ok(phong.albedo_max <= 0.7 + 1e-9 && phong.albedo_max > 0.6,
           "directional albedo is at most kd + ks # %.6f", phong.albedo_max);
    tap_ok(phong.residual < 0.25, "order 8 holds exponent 15 # residual %.3f",
           phong.residual);
    static const int order[] = {2, 4, 6, 8, 10, 12};
    double before = 1;
    for (size_t k = 0; k < imp_count(order); k++) {
        imp__basis_init(&b, order[k]);
        phong.residual = 0;
        if (imp__el_project(ctx, &a, &b, 1, "x", &phong) != IMP_OK) break;
        tap_ok(phong.residual < before, "the lobe's error falls: order %d # %.4f",
               order[k], phong.residual);
        before = phong.residual;
    }
    imp__arena_free(&a);
}

int main(void)
{
    imp_context *ctx;
    struct imp_context_options o = IMP_CONTEXT_OPTIONS_INIT;
    o.threads = 1;
    if (imp_context_create(&o, &ctx) != IMP_OK) return 99;
    form_factors();
    for (int order = 0; order <= 12; order += 2) gram(order);
    materials(ctx);
    imp_context_destroy(ctx);
    return tap_done();
}
