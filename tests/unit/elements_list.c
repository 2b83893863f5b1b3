/* SPDX-License-Identifier: Apache-2.0
 *
 * Elements one at a time: what arrives over single links adds up to what an element has,
 * what leaves the lamps to the measurement, and illuminance at points is that of the
 * closed form. */
#include "base/film.h"
#include "elements/elements.h"
#include "imp_scene.h"
#include "imp_tap.h"
#include <string.h>

static imp_elements *solved(imp_context *ctx, imp_scene *s,
                            const struct imp_elements_source *source, double eps)
{
    struct imp_elements_options o = IMP_ELEMENTS_OPTIONS_INIT;
    imp_elements *e;
    o.sources = source, o.n_sources = 1;
    o.stop = -1, o.eps_last = eps;
    test_must(ctx, imp_elements_create(s, &o, &e));
    test_must(ctx, imp_elements_solve(e));
    const struct imp_elements_row *rows; /* reflections have died away behind this */
    size_t n;
    test_must(ctx, imp_elements_sensitivity(e, &rows, &n));
    return e;
}

static struct imp_elements_element element(imp_context *ctx, const imp_elements *e,
                                           size_t k)
{
    struct imp_elements_element x = IMP_ELEMENTS_ELEMENT_INIT;
    test_must(ctx, imp_elements_get_element(e, k, &x));
    return x;
}

static void sums(imp_context *ctx)
{
    static const struct imp_elements_source floor_of = {
        .size = sizeof floor_of, .kind = IMP_ELEMENTS_SHAPE, .shape = "floor"};
    imp_scene *s = test_scene(ctx, "cornell.xml", IMP_RGB, "res=8");
    imp_elements *e = solved(ctx, s, &floor_of, 2e-3);
    struct imp_elements_info info = {.size = sizeof info};
    test_must(ctx, imp_elements_get_info(e, &info));
    double worst = 0, flux = 0, area = 0, from_lamps = 0, parts = 0, order = 0;
    size_t inner = 0;
    for (size_t k = 0; k < info.elements; k++) {
        const struct imp_elements_element x = element(ctx, e, k);
        struct imp_elements_arrival *a;
        size_t n;
        double sum[3] = {0};
        test_must(ctx, imp_elements_arrivals(e, k, &a, &n));
        for (size_t i = 0; i < n; i++) {
            for (int c = 0; c < 3; c++) sum[c] += a[i].irradiance[c];
            if (i) order = fmax(order, a[i].illuminance - a[i - 1].illuminance);
            const struct imp_elements_element j = element(ctx, e, a[i].from);
            if (x.leaf && !strcmp(j.shape, "light_panel")) from_lamps += a[i].measure;
        }
        for (int c = 0; c < 3 && isfinite(x.irradiance[c]); c++)
            worst = fmax(worst, fabs(sum[c] - x.irradiance[c]) /
                                    (x.irradiance[c] + 1e-3 * info.measure));
        if (x.leaf && x.source == 0 && x.area > 0) flux += x.area * x.illuminance;
        if (x.source == 0 && x.level == 0) area += e->roots[x.polygon].area;
        if (!x.leaf && isfinite(x.illuminance)) {
            double mean = 0;
            const struct imp__element *raw = &e->elements[k];
            for (uint32_t q = 0; q < 4; q++) {
                const struct imp_elements_element y = element(ctx, e, raw->child + q);
                if (y.area > 0) mean += y.area / x.area * y.illuminance;
                parts += y.parent != k;
            }
            parts = fmax(parts, fabs(mean - x.illuminance) / (fabs(mean) + 1e-9));
            inner++;
        }
        imp_free(ctx, a);
    }
    tap_ok(inner > 20 && info.leaves > 100, "a hierarchy of some size");
    tap_near(worst, 0, 1e-9, 1e-9, "arrivals over links add up to the irradiance");
    tap_near(parts, 0, 1e-12, 1e-12, "an element has the mean of its parts");
    tap_ok(order <= 0, "the brightest comes first");
    tap_near(flux / area, info.measure, 1e-9, 0, "the floor's mean is the measurement");
    /* The light panel is no perfect absorber: what it reflects arrives over the same links. */
    double emitted = 0, all = 0;
    for (size_t k = 0; k < e->n_links; k++) {
        const struct imp__el_root *r = imp__el_root_of(e, &e->elements[e->links[k].src]);
        imp_spec out[3] = {{0}}, light[3], g[3];
        if (r->light == EL_DARK) continue;
        imp__el_emission(e, &e->links[k], r, out);
        imp__el_ends(e, &e->links[k], light, g);
        for (int c = 0; c < 3; c++)
            for (int q = 0; q < 4; q++) {
                emitted += e->links[k].k[q] * out[c][q] * g[c][q];
                all += e->links[k].k[q] * light[c][q] * g[c][q];
            }
    }
    tap_near(emitted, info.measure_adjoint, 1e-9, 0, "emission x importance");
    tap_near(from_lamps, all, 1e-9, 0, "arrivals carry the measurement");
    imp_elements_destroy(e);
    imp_scene_destroy(s);
}

/* A desk of side 1 under an equal lamp at distance 1: illuminance of its middle is that of
 * a rectangle a x b seen from below a corner, four times (Howell, catalogue of view
 * factors, B-3):
 *     F = (A/sqrt(1+A^2) atan(B/sqrt(1+A^2)) + B/sqrt(1+B^2) atan(A/sqrt(1+B^2)))/(2 pi) */
static double corner(double a, double b)
{
    const double p = sqrt(1 + a * a), q = sqrt(1 + b * b);
    return (a / p * atan(b / p) + b / q * atan(a / q)) / (2 * IMP_PI);
}

static void points(imp_context *ctx)
{
    static const char *const text =
        "<scene version='3.0.0'><sensor type='perspective'/>"
        "<shape type='rectangle' id='lamp'><transform name='to_world'><scale "
        "value='0.5'/>"
        "<rotate x='1' angle='180'/><translate z='1'/></transform>"
        "<bsdf type='diffuse'><float name='reflectance' value='0'/></bsdf>"
        "<emitter type='area'><float name='radiance' "
        "value='2'/></emitter></shape></scene>";
    static const struct imp_elements_source plane = {.size = sizeof plane,
                                                     .kind = IMP_ELEMENTS_PLANE,
                                                     .origin = {-0.5, -0.5, 0},
                                                     .edge_u = {1, 0, 0},
                                                     .edge_v = {0, 1, 0}};
    imp_scene *s = test_scene_text(ctx, text, IMP_MONO);
    imp_elements *e = solved(ctx, s, &plane, 1e-2);
    struct imp_elements_info info = {.size = sizeof info};
    double lux[3][5];
    size_t root = 0;
    test_must(ctx, imp_elements_get_info(e, &info));
    while (element(ctx, e, root).shape) root++;
    const struct imp_elements_element x = element(ctx, e, root);
    tap_ok(x.source == 0 && x.parent == IMP_ELEMENTS_NO_PARENT && x.level == 0,
           "the plane, whole");
    test_must(ctx, imp_elements_illuminance(e, root, 5, 3, *lux));
    double worst = 0;
    for (int j = 0; j < 3; j++)
        for (int i = 0; i < 5; i++) {
            const double u = (i + 0.5) / 5, v = (j + 0.5) / 3;
            const double f =
                corner(u, v) + corner(1 - u, v) + corner(u, 1 - v) + corner(1 - u, 1 - v);
            worst = fmax(worst, fabs(lux[j][i] / (2 * IMP_PI * f) - 1));
        }
    tap_near(worst, 0, 1e-12, 1e-12, "illuminance at points, in closed form");
    struct imp_elements_arrival *none;
    size_t n;
    struct imp_elements_element out = IMP_ELEMENTS_ELEMENT_INIT;
    tap_ok(imp_elements_get_element(e, info.elements, &out) == IMP_E_ARG &&
               imp_elements_arrivals(e, info.elements, &none, &n) == IMP_E_ARG &&
               imp_elements_illuminance(e, root, 0, 3, *lux) == IMP_E_ARG,
           "what is not there is refused");
    imp_elements_destroy(e);
    imp_scene_destroy(s);
}

int main(void)
{
    imp_context *ctx = test_context(1);
    sums(ctx);
    points(ctx);
    imp_context_destroy(ctx);
    return tap_done();
}
