/* SPDX-License-Identifier: Apache-2.0
 *
 * Fields in r^2 and z, and grids whose nodes are tied by a symmetry: closed forms,
 * symmetric points, the same function when refined, T^T of the free grid's gradient, and
 * the derivative of traced rays against central differences. */
#include "bend_kit.h"
#include <math.h>
#include <string.h>

#define N 40

static double at(const imp_field *f, double x, double y, double z)
{
    double eta;
    imp_field_eval(f, (double[3]){x, y, z}, &eta, NULL, NULL);
    return eta;
}

/* Linear coefficients are a linear spline: eta = 1.2 + 0.1 r^2 z + 0.05 z, exactly. */
static void rz_closed(void)
{
    struct imp_field_rz d = IMP_FIELD_RZ_INIT;
    imp_field *f;
    d.cells_r = 5, d.cells_z = 4, d.radius = 1.1, d.lo = -1, d.hi = 1.4;
    KIT_CHECK(imp_field_rz_create(kit_ctx, &d, 1, &f));
    double c[8 * 7], worst = 0;
    for (int l = 0; l < 7; l++)
        for (int k = 0; k < 8; k++) {
            const double u = (k - 1) * 1.21 / 5, z = -1 + (l - 1) * 2.4 / 4;
            c[8 * l + k] = 1.2 + 0.1 * u * z + 0.05 * z;
        }
    KIT_CHECK(imp_field_set_theta(f, c));
    for (int i = 0; i < 100; i++) {
        const double x = kit_pm(1, i), y = kit_pm(2, i), z = kit_pm(3, i);
        const double g[3] = {0.2 * x * z, 0.2 * y * z, 0.1 * (x * x + y * y) + 0.05};
        const double h[6] = {0.2 * z, 0.2 * z, 0, 0, 0.2 * x, 0.2 * y};
        double eta, gf[3], hf[6];
        imp_field_eval(f, (double[3]){x, y, z}, &eta, gf, hf);
        worst = fmax(worst, fabs(eta - (1.2 + 0.1 * (x * x + y * y) * z + 0.05 * z)));
        for (int k = 0; k < 3; k++) worst = fmax(worst, fabs(gf[k] - g[k]));
        for (int k = 0; k < 6; k++) worst = fmax(worst, fabs(hf[k] - h[k]));
    }
    tap_ok(worst < 1e-12, "r^2 and z: value, gradient, Hessian of r^2 z # %.1e", worst);
    imp_field_destroy(f);
}

static imp_field *grid_new(enum imp_field_interp interp, double noise)
{
    struct imp_field_grid g = IMP_FIELD_GRID_INIT;
    imp_field *f;
    g.interp = interp;
    for (int k = 0; k < 3; k++) g.cells[k] = 6, g.lo[k] = -1, g.hi[k] = 1;
    KIT_CHECK(imp_field_grid_create(kit_ctx, &g, 1.3, &f));
    for (size_t i = 0; i < f->n_theta; i++) f->theta[i] += noise * kit_pm(4, i);
    imp__grid_changed(f);
    return f;
}

static void symmetries(void)
{
    static const struct {
        const char *name;
        struct imp_field_symmetry s;
        double image[3][3]; /* matrix of an operation */
        double limit;       /* of the axial field: it is so only at nodes */
    } cases[] = {
        {"mirror x",
         {sizeof cases[0].s, {1, 0, 0}, 2, 0},
         {{-1, 0, 0}, {0, 1, 0}, {0, 0, 1}},
         1e-14},
        {"mirrors y z",
         {sizeof cases[0].s, {0, 1, 1}, 2, 0},
         {{1, 0, 0}, {0, -1, 0}, {0, 0, -1}},
         1e-14},
        {"two turns about y",
         {sizeof cases[0].s, {0}, 1, 2},
         {{-1, 0, 0}, {0, 1, 0}, {0, 0, -1}},
         1e-14},
        {"four turns about z",
         {sizeof cases[0].s, {0}, 2, 4},
         {{0, -1, 0}, {1, 0, 0}, {0, 0, 1}},
         1e-14},
        {"four turns and a mirror",
         {sizeof cases[0].s, {1, 0, 0}, 2, 4},
         {{0, 1, 0}, {1, 0, 0}, {0, 0, 1}},
         1e-14},
        {"axial about x",
         {sizeof cases[0].s, {0}, 0, IMP_FIELD_AXIAL},
         {{1, 0, 0}, {0, 0, -1}, {0, -1, 0}},
         1e-14},
    };
    for (size_t c = 0; c < imp_count(cases); c++)
        for (int interp = 0; interp < 2; interp++) {
            imp_field *f, *fine,
                *free_grid = grid_new((enum imp_field_interp)interp, 0.1);
            KIT_CHECK(imp_field_tie_create(
                kit_ctx, grid_new((enum imp_field_interp)interp, 0.1), &cases[c].s, &f));
            KIT_CHECK(imp_field_refine(f, &fine));
            double same = 0, refined = 0;
            for (int i = 0; i < 200; i++) {
                const double p[3] = {kit_pm(5, i), kit_pm(6, i), kit_pm(7, i)};
                double q[3] = {0};
                for (int k = 0; k < 3; k++)
                    for (int m = 0; m < 3; m++) q[k] += cases[c].image[k][m] * p[m];
                const double eta = at(f, p[0], p[1], p[2]);
                same = fmax(same, fabs(eta - at(f, q[0], q[1], q[2])));
                refined = fmax(refined, fabs(eta - at(fine, p[0], p[1], p[2])));
            }
            const bool axial = cases[c].s.fold == IMP_FIELD_AXIAL;
            tap_ok(same < cases[c].limit && (axial ? refined < 0.05 : refined < 1e-14) &&
                       f->n_theta < free_grid->n_theta,
                   "%s: %zu numbers of %zu # symmetric to %.1e, refined %.1e",
                   cases[c].name, f->n_theta, free_grid->n_theta, same, refined);
            /* The transpose is T^T of the free grid's. */
            const struct imp__tie *t = (const struct imp__tie *)f;
            double *bar = calloc(f->n_theta, sizeof *bar),
                   *sum = calloc(f->n_theta, sizeof *sum),
                   *own = calloc(free_grid->n_theta, sizeof *own), worst = 0;
            for (int i = 0; i < 20; i++) {
                const double p[3] = {kit_pm(8, i), kit_pm(9, i), kit_pm(10, i)},
                             b[3] = {kit_pm(11, i), kit_pm(12, i), kit_pm(13, i)};
                imp_field_splat(f, p, 0.7, b, bar);
                imp_field_splat(free_grid, p, 0.7, b, own);
            }
            for (size_t i = 0; i < free_grid->n_theta; i++) sum[t->number[i]] += own[i];
            for (size_t i = 0; i < f->n_theta; i++)
                worst = fmax(worst, fabs(bar[i] - sum[i]));
            tap_ok(worst < 1e-12, "%s: transpose adds up over orbits # %.1e",
                   cases[c].name, worst);
            free(bar), free(sum), free(own);
            imp_field_destroy(f), imp_field_destroy(fine), imp_field_destroy(free_grid);
        }
    /* What is refused. */
    imp_field *f = NULL;
    struct imp_field_symmetry s = IMP_FIELD_SYMMETRY_INIT;
    s.fold = 4;
    tap_ok(imp_field_tie_create(kit_ctx, kit_grid(0, 0, 5, 1, 0), &s, &f) == IMP_E_ARG,
           "quarter turns of a grid that is not square # %s", imp_last_error(kit_ctx));
    s.fold = 3;
    tap_ok(imp_field_tie_create(kit_ctx, grid_new(0, 0), &s, &f) == IMP_E_ARG,
           "three turns # %s", imp_last_error(kit_ctx));
    const double p[4] = {1.5, 0, 0, 0};
    s.fold = 2;
    tap_ok(imp_field_tie_create(kit_ctx, kit_profile("constant", p, NULL), &s, &f) ==
               IMP_E_ARG,
           "a profile # %s", imp_last_error(kit_ctx));
}

/* Rays with their end on a tilted plane inside the field: d (sum of exits) along a
 * random direction of all numbers. */
static void rays(int kind)
{
    const char *name;
    imp_field *f = kit_field(kind, &name);
    struct imp_bend_options o = IMP_BEND_OPTIONS_INIT;
    struct imp_bend_surface s = IMP_BEND_SURFACE_INIT;
    struct imp_bend_rays r = kit_beam(N, -0.7, 0.5, 0.2);
    struct imp_bend_exit e[2][N];
    struct imp_bend_cotangent bar[N];
    struct imp_bend_gradient g = IMP_BEND_GRADIENT_INIT;
    s.normal[0] = 0.2, s.offset = 0.6;
    o.surfaces = &s, o.n_surfaces = 1, o.step = 0.04;
    const size_t n = f->n_theta;
    double *theta = malloc(3 * n * sizeof *theta), *moved = theta + n,
           *got = theta + 2 * n;
    imp_field_get_theta(f, theta);
    KIT_CHECK(imp_bend_trace(f, &o, &r, e[0], NULL, NULL));
    for (int i = 0; i < N; i++)
        for (int k = 0; k < 3; k++)
            bar[i].x[k] = kit_pm(20 + k, i), bar[i].v[k] = kit_pm(23 + k, i),
            bar[i].path = kit_pm(26, i);
    g.theta = got;
    KIT_CHECK(imp_bend_adjoint(f, &o, &r, e[0], NULL, bar, NULL, &g, NULL));
    double want = 0, difference = 0;
    const double eps = 1e-5;
    bool same = true;
    for (size_t k = 0; k < n; k++) want += got[k] * kit_pm(27, k);
    for (int side = 0; side < 2; side++) {
        for (size_t k = 0; k < n; k++)
            moved[k] = theta[k] + (side ? -eps : eps) * kit_pm(27, k);
        KIT_CHECK(imp_field_set_theta(f, moved));
        KIT_CHECK(imp_bend_trace(f, &o, &r, e[side], NULL, NULL));
    }
    for (int i = 0; i < N; i++) {
        same = same && e[0][i].steps == e[1][i].steps;
        for (int k = 0; k < 3; k++)
            difference += bar[i].x[k] * (e[0][i].x[k] - e[1][i].x[k]) +
                          bar[i].v[k] * (e[0][i].v[k] - e[1][i].v[k]);
        difference += bar[i].path * (e[0][i].path - e[1][i].path);
    }
    tap_ok(same && fabs(difference / (2 * eps) / want - 1) < 1e-6,
           "%s: adjoint of rays is the difference # %.10g %.10g", name, want,
           difference / (2 * eps));
    free(theta);
    kit_rays_free(&r);
    imp_field_destroy(f);
}

/* A file that says so, and its fit over two levels; rz through its own file. */
static void files(void)
{
    static const char xml[] =
        "<scene version='3.0.0'><medium type='graded'>"
        "<volume type='grid'><integer name='cells' value='6'/>"
        "<string name='symmetry' value='mirror-x fourfold-z'/></volume>"
        "<integer name='hold_rim' value='2'/></medium>"
        "<rays type='beam'><integer name='count' value='200'/>"
        "<float name='radius' value='0.6'/><target type='focus'>"
        "<vector name='point' value='0 0 3'/><float name='plane' value='3'/></target>"
        "</rays></scene>";
    imp_bend *b;
    struct imp_bend_fit_options o = IMP_BEND_FIT_OPTIONS_INIT;
    struct imp_bend_fit_result r = {.size = sizeof r};
    KIT_CHECK(imp_bend_load_string(kit_ctx, xml, sizeof xml - 1, "tied.xml", NULL, &b));
    o.levels = 2, o.iterations[0] = 15;
    KIT_CHECK(imp_bend_fit(b, &o, &r));
    const imp_field *f = imp_bend_field(b);
    double worst = 0;
    for (int i = 0; i < 100; i++) {
        const double x = kit_pm(1, i), y = kit_pm(2, i), z = kit_pm(3, i);
        worst = fmax(worst, fabs(at(f, x, y, z) - at(f, -y, x, z)));
        worst = fmax(worst, fabs(at(f, x, y, z) - at(f, -x, y, z)));
    }
    tap_ok(r.value < 0.01 * r.start && worst < 1e-13 && r.levels == 2,
           "a symmetric lens in two levels # %.2e -> %.2e, symmetric to %.1e", r.start,
           r.value, worst);
    KIT_CHECK(imp_field_write(f, "bend_symmetry.npy"));
    imp_field *read;
    KIT_CHECK(imp_field_read(kit_ctx, "bend_symmetry.npy", NULL, &read));
    tap_ok(!strcmp(imp_field_kind(read), "spline"), "a tied grid is written as a grid");
    imp_field_destroy(read);
    remove("bend_symmetry.npy");
    imp_bend_destroy(b);

    const char *name, *path = "bend_symmetry.txt";
    imp_field *rz = kit_field(18, &name);
    KIT_CHECK(imp_field_write(rz, path));
    KIT_CHECK(imp_field_read(kit_ctx, path, NULL, &read));
    struct imp_field_rz d[2] = {{.size = sizeof *d}, {.size = sizeof *d}};
    KIT_CHECK(imp_field_get_rz(rz, &d[0]));
    KIT_CHECK(imp_field_get_rz(read, &d[1]));
    tap_ok(read->n_theta == rz->n_theta && d[0].cells_z == d[1].cells_z &&
               !memcmp(read->theta, rz->theta, rz->n_theta * sizeof(double)) &&
               fabs(at(read, 0.3, -0.2, 0.5) - at(rz, 0.3, -0.2, 0.5)) < 1e-15,
           "r^2 and z: written and read, the same");
    imp_field_destroy(read), imp_field_destroy(rz);
    /* Cut off anywhere, or with sizes that lie: an error, never a crash. */
    FILE *in = fopen(path, "rb");
    char text[8192];
    const size_t length = fread(text, 1, sizeof text, in);
    int refused = 0, cuts = 0;
    fclose(in);
    for (size_t cut = 0; cut + 2 < length; cut += 37, cuts++) {
        FILE *out = fopen(path, "wb");
        fwrite(text, 1, cut, out);
        fclose(out);
        read = NULL;
        refused += imp_field_read(kit_ctx, path, NULL, &read) == IMP_E_SCENE && !read;
    }
    tap_ok(refused == cuts, "a file cut off at %d places is refused", cuts);
    FILE *out = fopen(path, "wb");
    fprintf(out, "importon-profile 1\nrz\ncentre 0 0 0\naxis 0 0 1\nradius 1\nz -1 1\n"
                 "coefficients 8195 8195\n1 1 1\n");
    fclose(out);
    tap_ok(imp_field_read(kit_ctx, path, NULL, &read) == IMP_E_SCENE,
           "large sizes, few numbers # %s", imp_last_error(kit_ctx));
    remove(path);
}

int main(void)
{
    kit_begin(2);
    rz_closed();
    symmetries();
    for (int kind = 18; kind <= 21; kind++) rays(kind);
    files();
    imp_context_destroy(kit_ctx);
    return tap_done();
}
