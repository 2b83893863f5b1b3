/* SPDX-License-Identifier: Apache-2.0
 *
 * Stam's Figure 6 as he drew it: one walk with two M2 and two M3 scatterings that ends on
 * a wall, J = 1/2 L^2 (target 0), derivatives of J/J0 by the adjoint, and differences for
 * four steps, in double and in float. Test and table: docs/stam.md quotes what it prints.
 * Its identities (docs/estimators.md 2.4): th6 d6 = 2, th7 d7 = 4,
 * th3 d3 + th4 d4 = 4. */
#include "stam_walks.h"

/* J/J0 in float, the paper's arithmetic: the same products, each rounded. */
static float ratio_float(const struct imp_walk *w, const double *theta, double absorb,
                         const double *start)
{
    float L[2] = {1, 1};
    const double *at[2] = {theta, start};
    for (int k = 0; k < 2; k++)
        for (const struct imp_vertex *v = w->first; v; v = v->next) {
            const struct imp_dirs dirs = imp__vertex_dirs(v);
            if (!v->next) {
                L[k] *= (float)at[k][AMBIENT3] / (float)absorb;
            } else if (stam_is(v, "sphere")) {
                L[k] *=
                    (float)stam_m2(&dirs, STAM_MICROFACET, at[k]).v * (float)v->scale[0];
            } else {
                L[k] *= (float)at[k][DIFFUSE3] * (float)(v->d.wi[2] / M_PI) *
                        (float)v->scale[0];
            }
        }
    return (L[0] * L[0]) / (L[1] * L[1]);
}

int main(void)
{
    static const double eps[] = {1e-1, 1e-4, 1e-7, 1e-10};
    imp_context *ctx = test_context(1);
    struct stam s = stam_walks(ctx, test_scene(ctx, "stam.xml", IMP_MONO, NULL), 0);
    const double *t = s.theta;
    struct imp_walk w = {0};
    int n2 = 0, n3 = 0;
    int64_t k = 0;
    for (; k < 10000000; k++) {
        const struct imp_arena_mark mark = imp__arena_mark(&s.arena);
        w = stam_trace(&s, (int)(k & 31), (int)(k >> 5 & 31), k >> 10);
        stam_value(&w, STAM_MICROFACET, s.absorb, t, &n2, &n3);
        /* Bright enough to see, one of its two M2 scatterings mostly specular. */
        if (w.absorbed && n2 == 2 && n3 == 2 && stam_is(w.last, "walls") &&
            w.L[0] > 1e-3) {
            double g[N_CONTROLS];
            stam_gradient(&s, &w, 1, g);
            if (t[SPECULAR] * g[SPECULAR] > w.L[0] && g[EXPONENT] > 0) break;
        }
        imp__arena_rewind(&s.arena, mark);
    }
    printf("# importon render -m mono scenes/stam.xml --pixel %d,%d --sample %d\n",
           (int)(k & 31), (int)(k >> 5 & 31), (int)(k >> 10));
    const double L = w.L[0];
    double g[N_CONTROLS], d[N_CONTROLS];
    stam_gradient(&s, &w, L, g); /* the adjoint of 1/2 L^2 is L */
    printf("# J = %.9g\n# d (J/J0)/d control, adjoint and (J+ - J-)/(2 eps J0)\n",
           L * L / 2);
    printf("# %-22s %-12s", "control", "adjoint");
    for (int e = 0; e < 4; e++) printf(" eps %-8g", eps[e]);
    for (int e = 0; e < 4; e++) printf(" float %-6g", eps[e]);
    printf("\n");
    double best = 0, best_float[4] = {0}, largest_last = 0;
    for (int c = 0; c < N_CONTROLS; c++) {
        d[c] = g[c] / (L * L / 2);
        printf("# %-22s %-12.7g", control_name[c], d[c]);
        float single[4];
        for (int e = 0; e < 4; e++) {
            double up[N_CONTROLS], down[N_CONTROLS];
            int n;
            memcpy(up, t, sizeof up);
            memcpy(down, t, sizeof down);
            up[c] += eps[e];
            down[c] -= eps[e];
            const double a = stam_value(&w, STAM_MICROFACET, s.absorb, up, &n, &n).v;
            const double b = stam_value(&w, STAM_MICROFACET, s.absorb, down, &n, &n).v;
            const double fd = (a * a - b * b) / (2 * eps[e]) / (L * L);
            const float h = (float)eps[e];
            single[e] =
                (ratio_float(&w, up, s.absorb, t) - ratio_float(&w, down, s.absorb, t)) /
                (2 * h);
            printf(" %-12.6g", fd);
            if (e == 1) best = fmax(best, fabs(fd - d[c]) / fmax(fabs(d[c]), 1e-3));
        }
        for (int e = 0; e < 4; e++) {
            printf(" %-12.6g", single[e]);
            if (d[c] != 0 && c != EXPONENT) /* whose difference float sees least of all */
                best_float[e] = fmax(best_float[e], fabs(single[e] - d[c]) / fabs(d[c]));
        }
        largest_last = fmax(largest_last, fabs(single[3]));
        printf("\n");
    }
    tap_ok(k < 10000000 && n2 == 2 && n3 == 2,
           "two M2, two M3, and a wall's ambient term");
    tap_near(t[AMBIENT3] * d[AMBIENT3], 2, 2e-15, 0, "th6 d6 = 2");
    tap_near(t[DIFFUSE3] * d[DIFFUSE3], 4, 2e-15, 0, "th7 d7 = 4");
    tap_near(t[DIFFUSE2] * d[DIFFUSE2] + t[SPECULAR] * d[SPECULAR], 4, 2e-15, 0,
             "th3 d3 + th4 d4 = 4");
    tap_ok(d[EMISSION] == 0 && d[AMBIENT2] == 0,
           "no light and no glow of the sphere in it");
    tap_ok(best < 1e-5, "differences in double, eps 1e-4 # worst %.1e", best);
    tap_ok(best_float[1] > 1e-5 && best_float[1] < .05 && largest_last == 0,
           "E29: in float at best a few digits (eps 1e-4), then nothing # worst %.1e, at "
           "1e-10 "
           "all are %g",
           best_float[1], largest_last);
    stam_close(&s);
    imp_context_destroy(ctx);
    return tap_done();
}
