/* SPDX-License-Identifier: Apache-2.0
 *
 * Shared by the tests of bent rays: fields of every kind, bundles of rays. */
#ifndef BEND_KIT_H
#define BEND_KIT_H

#include "bend/bend_rays.h"
#include "imp_tap.h"
#include "math/rng.h"
#include <stdlib.h>

static inline double kit_u(uint64_t stream, uint64_t i) /* uniform on [0, 1) */
{
    return imp__u01(imp__key(20220701, stream, i), 0);
}
static inline double kit_pm(uint64_t stream, uint64_t i)
{
    return 2 * kit_u(stream, i) - 1;
}

#define KIT_CHECK(call)                                                                  \
    do {                                                                                 \
        const enum imp_status st_ = (call);                                              \
        if (st_ != IMP_OK) {                                                             \
            printf("Bail out! %s:%d: %s (%s)\n", __FILE__, __LINE__, #call,              \
                   imp_last_error(kit_ctx));                                             \
            exit(1);                                                                     \
        }                                                                                \
    } while (0)

static imp_context *kit_ctx;
static inline void kit_begin(int threads)
{
    struct imp_context_options o = IMP_CONTEXT_OPTIONS_INIT;
    o.threads = threads;
    if (imp_context_create(&o, &kit_ctx) != IMP_OK) exit(1);
}

/* A grid over the box +-half (a little uneven, to have h differ by axis). */
static inline imp_field *kit_grid(enum imp_field_interp interp,
                                  enum imp_field_param param, int cells, double half,
                                  double noise)
{
    struct imp_field_grid d = IMP_FIELD_GRID_INIT;
    imp_field *f;
    d.interp = interp;
    d.param = param;
    for (int k = 0; k < 3; k++) {
        d.cells[k] = cells + k;
        d.lo[k] = -half - 0.01 * k, d.hi[k] = half + 0.02 * k;
    }
    KIT_CHECK(imp_field_grid_create(kit_ctx, &d, 1.3, &f));
    const size_t n = imp_field_n_theta(f);
    double *theta = malloc(n * sizeof *theta);
    imp_field_get_theta(f, theta);
    for (size_t i = 0; i < n; i++) theta[i] += noise * kit_pm(1, i);
    KIT_CHECK(imp_field_set_theta(f, theta));
    free(theta);
    return f;
}

static inline imp_field *kit_profile(const char *kind, const double *p,
                                     const double *axis)
{
    imp_field *f;
    KIT_CHECK(imp_field_profile_create(kit_ctx, kind, p, axis, &f));
    return f;
}

/* One of every kind; NULL past the last. *name says which. */
static inline imp_field *kit_field(int i, const char **name)
{
    static const double tilt[3] = {0.3, -0.2, 0.9};
    static const struct {
        const char *kind;
        double p[8];
    } profiles[] = {
        {"constant", {1.4, 0, 0, 0}},
        {"luneburg", {1.3, 0.1, -0.05, 0.02}},
        {"maxwell", {2.0, 1.1, 0.05, 0, -0.1}},
        {"rod", {1.6, 0.33, 0.02, 0.1, 0}},
        {"rod-vendor", {1.6, 0.11, 0, -0.1, 0}},
        {"rod-power", {1.6, 0.33, 0.6, -0.4, 0.1, 0, 0}},
        {"sech", {1.5, 0.7, 0.1, 0, 0}},
        {"plume", {1.1, 0.3, 0.6, 0.1, 0.2, -0.1}},
        {"polynomial", {1.5, -0.1, 0.02, 0.01, -0.003, 0.05, 0.1, 0}},
        {"axial", {1.5, 0.1, 0.03, -0.02, 0.01, 0, 0, 0.1}},
        {"linear", {1.5, 0.2, 0.1, 0, 0}},
    };
    static char label[64];
    imp_field *f = NULL;
    *name = label;
    if (i < 11) {
        snprintf(label, sizeof label, "%s", profiles[i].kind);
        return kit_profile(profiles[i].kind, profiles[i].p, tilt);
    }
    struct imp_field_radial r = IMP_FIELD_RADIAL_INIT;
    r.cells = 9;
    r.radius = 1.4;
    r.centre[0] = 0.1;
    memcpy(r.axis, tilt, sizeof tilt);
    switch (i) {
    case 11:
    case 12:
        r.cylinder = i == 12;
        snprintf(label, sizeof label, "radial %s", r.cylinder ? "cylinder" : "sphere");
        KIT_CHECK(imp_field_radial_create(kit_ctx, &r, 1.4, &f));
        double theta[12];
        for (int k = 0; k < 12; k++) theta[k] = 1.4 + 0.1 * kit_pm(2, k);
        KIT_CHECK(imp_field_set_theta(f, theta));
        return f;
    case 13:
        snprintf(label, sizeof label, "spline grid");
        return kit_grid(IMP_FIELD_SPLINE, IMP_FIELD_ETA, 7, 1.1, 0.1);
    case 14:
        snprintf(label, sizeof label, "trilinear grid");
        return kit_grid(IMP_FIELD_TRILINEAR, IMP_FIELD_ETA, 7, 1.1, 0.1);
    case 15:
        snprintf(label, sizeof label, "spline grid of eta^2/2");
        return kit_grid(IMP_FIELD_SPLINE, IMP_FIELD_ETA2, 6, 1.1, 0.1);
    case 16:
        snprintf(label, sizeof label, "trilinear grid of eta^2/2");
        return kit_grid(IMP_FIELD_TRILINEAR, IMP_FIELD_ETA2, 6, 1.1, 0.1);
    case 17: {
        const char *unused;
        imp_field *parts[3] = {kit_field(13, &unused), kit_field(7, &unused),
                               kit_field(12, &unused)};
        snprintf(label, sizeof label, "sum of grid, plume and cylinder");
        KIT_CHECK(imp_field_sum_create(kit_ctx, 3, parts, &f));
        return f;
    }
    case 18: {
        struct imp_field_rz rz = IMP_FIELD_RZ_INIT;
        rz.cells_r = 6, rz.cells_z = 7, rz.radius = 1.3, rz.lo = -1.2, rz.hi = 1.1;
        rz.centre[1] = 0.1;
        memcpy(rz.axis, tilt, sizeof tilt);
        snprintf(label, sizeof label, "r^2 and z");
        KIT_CHECK(imp_field_rz_create(kit_ctx, &rz, 1.4, &f));
        double c[90];
        for (int k = 0; k < 90; k++) c[k] = 1.4 + 0.1 * kit_pm(7, k);
        KIT_CHECK(imp_field_set_theta(f, c));
        return f;
    }
    case 19:
    case 20:
    case 21: {
        struct imp_field_grid g = IMP_FIELD_GRID_INIT;
        struct imp_field_symmetry s = IMP_FIELD_SYMMETRY_INIT;
        g.interp = i == 20 ? IMP_FIELD_TRILINEAR : IMP_FIELD_SPLINE;
        g.param = i == 21 ? IMP_FIELD_ETA2 : IMP_FIELD_ETA;
        for (int k = 0; k < 3; k++)
            g.cells[k] = 6 + (k == 0), g.lo[k] = -1.1 - 0.2 * (k == 0), g.hi[k] = 1.15;
        s.axis = 0;
        s.fold = i == 19 ? 4 : i == 20 ? 2 : IMP_FIELD_AXIAL;
        s.mirror[i == 20 ? 1 : 0] = i != 21;
        snprintf(label, sizeof label, "tied grid, fold %d", s.fold);
        KIT_CHECK(imp_field_grid_create(kit_ctx, &g, 1.3, &f));
        KIT_CHECK(imp_field_tie_create(kit_ctx, f, &s, &f));
        const size_t n = imp_field_n_theta(f);
        double *p = malloc(n * sizeof *p);
        imp_field_get_theta(f, p);
        for (size_t k = 0; k < n; k++) p[k] += 0.1 * kit_pm(8, k);
        KIT_CHECK(imp_field_set_theta(f, p));
        free(p);
        return f;
    }
    case 22: {
        const char *unused;
        snprintf(label, sizeof label, "scaled sum");
        KIT_CHECK(imp_field_scaled_create(kit_ctx, kit_field(17, &unused), 1.2, &f));
        snprintf(label, sizeof label, "scaled sum");
        return f;
    }
    }
    return NULL;
}

/* n rays along +z from the plane z0, in a disc, with a little tilt. Free both arrays. */
static inline struct imp_bend_rays kit_beam(size_t n, double z0, double radius,
                                            double tilt)
{
    double(*x)[3] = calloc(n, sizeof *x), (*d)[3] = calloc(n, sizeof *d);
    for (size_t i = 0; i < n; i++) {
        const double r = radius * sqrt(kit_u(3, i)), a = IMP_2PI * kit_u(4, i);
        x[i][0] = r * cos(a), x[i][1] = r * sin(a), x[i][2] = z0;
        d[i][0] = tilt * kit_pm(5, i), d[i][1] = tilt * kit_pm(6, i), d[i][2] = 1;
    }
    return (struct imp_bend_rays){.size = sizeof(struct imp_bend_rays),
                                  .n = n,
                                  .x = (const double(*)[3])x,
                                  .d = (const double(*)[3])d,
                                  .group = NULL};
}
static inline void kit_rays_free(struct imp_bend_rays *r)
{
    free((void *)(uintptr_t)r->x);
    free((void *)(uintptr_t)r->d);
}

#endif
