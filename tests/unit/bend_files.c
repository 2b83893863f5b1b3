/* SPDX-License-Identifier: Apache-2.0
 *
 * Files of index fields: written and read back, cut off at every length, and hostile
 * headers; files of problems: what they make, random damage. */
#include "bend/bend_problem.h"
#include "bend_kit.h"
#include <unistd.h>

static unsigned char *slurp(const char *path, size_t *n)
{
    FILE *f = fopen(path, "rb");
    if (!f) return NULL;
    fseek(f, 0, SEEK_END);
    *n = (size_t)ftell(f);
    rewind(f);
    unsigned char *d = malloc(*n + 1);
    if (fread(d, 1, *n, f) != *n) *n = 0;
    fclose(f);
    return d;
}
static void spill(const char *path, const unsigned char *d, size_t n)
{
    FILE *f = fopen(path, "wb");
    if (f && fwrite(d, 1, n, f) != n) printf("# cannot write %s\n", path);
    if (f) fclose(f);
}

static void round_trip(const char *path, imp_field *f, double limit)
{
    struct imp_field_grid g = IMP_FIELD_GRID_INIT;
    imp_field *back;
    if (imp__field_is_grid(f)) KIT_CHECK(imp_field_get_grid(f, &g));
    KIT_CHECK(imp_field_write(f, path));
    KIT_CHECK(imp_field_read(kit_ctx, path, imp__field_is_grid(f) ? &g : NULL, &back));
    double worst = 0;
    for (int i = 0; i < 200; i++) {
        const double x[3] = {0.9 * kit_pm(500, i), 0.9 * kit_pm(501, i),
                             0.9 * kit_pm(502, i)};
        double a, b;
        imp_field_eval(f, x, &a, NULL, NULL);
        imp_field_eval(back, x, &b, NULL, NULL);
        worst = fmax(worst, fabs(a - b));
    }
    tap_ok(worst < limit, "%s: read back # worst %.1e", path, worst);
    imp_field_destroy(back);

    size_t n = 0;
    unsigned char *d = slurp(path, &n);
    int refused = 0, tried = 0;
    for (size_t cut = 0; cut < n; cut += cut < 60 ? 1 : 97) {
        imp_field *h = NULL;
        spill("cut", d, cut);
        tried++;
        if (imp_field_read(kit_ctx, "cut", NULL, &h) != IMP_OK) refused++;
        imp_field_destroy(h);
    }
    /* The last byte of a text is the end of a line. */
    tap_ok(refused >= tried - 1, "%s: cut off, refused %d of %d", path, refused, tried);
    int survived = 0;
    for (int i = 0; i < 100; i++) { /* damaged: an error or a field, never a crash */
        imp_field *h = NULL;
        unsigned char *c = malloc(n);
        memcpy(c, d, n);
        for (int k = 0; k < 3; k++)
            c[(size_t)(kit_u(510 + k, i) * (double)imp_min(n, (size_t)160))] =
                (unsigned char)(256 * kit_u(520 + k, i));
        spill("cut", c, n);
        survived += imp_field_read(kit_ctx, "cut", NULL, &h) == IMP_OK || h == NULL;
        imp_field_destroy(h);
        free(c);
    }
    tap_ok(survived == 100, "%s: damaged, none crashes", path);
    free(d);
    unlink("cut");
    unlink(path);
}

static void npy_write(const char *path, const char *head, const double *v, size_t n)
{
    unsigned char *d = calloc(128 + 8 * n, 1);
    memcpy(d, "\x93NUMPY\x01\x00\x76\x00", 10);
    memset(d + 10, ' ', 118);
    memcpy(d + 10, head, strlen(head));
    memcpy(d + 128, v, 8 * n);
    spill(path, d, 128 + 8 * n);
    free(d);
}

/* NumPy writes a.T in Fortran order: the same array, the first axis fastest. */
static void fortran_order(void)
{
    enum { NX = 5, NY = 3, NZ = 4, N = NX * NY * NZ };
    double c[N], f[N];
    imp_field *fields[2];
    for (size_t z = 0; z < NZ; z++)
        for (size_t y = 0; y < NY; y++)
            for (size_t x = 0; x < NX; x++)
                f[z + NZ * (y + NY * x)] = c[x + NX * (y + NY * z)] =
                    1.3 + 0.1 * kit_u(570, x + NX * (y + NY * z));
    npy_write("c.npy", "{'descr': '<f8', 'fortran_order': False, 'shape': (4, 3, 5), }",
              c, N);
    npy_write("f.npy", "{'descr': '<f8', 'fortran_order': True, 'shape': (4, 3, 5), }", f,
              N);
    KIT_CHECK(imp_field_read(kit_ctx, "c.npy", NULL, &fields[0]));
    KIT_CHECK(imp_field_read(kit_ctx, "f.npy", NULL, &fields[1]));
    const size_t n = imp_field_n_theta(fields[0]);
    tap_ok(n == imp_field_n_theta(fields[1]) && n == (NX + 2) * (NY + 2) * (NZ + 2) &&
               !memcmp(fields[0]->theta, fields[1]->theta, n * sizeof(double)),
           "an .npy in Fortran order is the same field");
    imp_field_destroy(fields[0]);
    imp_field_destroy(fields[1]);
    remove("c.npy");
    remove("f.npy");
}

/* What is wrong with a file is said by name and number. */
static void messages(void)
{
    static const struct {
        const char *path, *head, *want;
    } npy[] = {
        {"a.npy", "{'descr': '>f8', 'fortran_order': False, 'shape': (2, 2, 2), }",
         "samples of type '>f8'"},
        {"a.npy", "{'descr': '<i4', 'fortran_order': False, 'shape': (2, 2, 2), }",
         "samples of type '<i4'"},
        {"a.npy", "{'descr': '<f8', 'fortran_order': False, 'shape': (2, 4), }",
         "an array of shape (2, 4): must be (Z, Y, X)"},
        {"a.npy", "{'descr': '<f8', 'fortran_order': False, 'shape': (2, 2, 2, 1), }",
         "an array of shape (2, 2, 2, 1)"},
        {"a.npy", "{'descr': '<f8', 'fortran_order': False, 'shape': (2, -2, 2), }",
         "-2 samples along y"},
        {"a.npy", "{'descr': '<f8', 'fortran_order': False, 'shape': (20, 2, 2), }",
         "cut off: 2 x 2 x 20 samples are 640 bytes, and 64 are there"},
        {"a.npy", "{'descr': '<f8', 'shape': (2, 2, 2), }", "malformed NPY header"},
    };
    double v[8] = {1, 1, 1, 1, 1, 1, 1, 1};
    imp_field *f = NULL;
    for (size_t i = 0; i < imp_count(npy); i++) {
        npy_write(npy[i].path, npy[i].head, v, 8);
        const enum imp_status st = imp_field_read(kit_ctx, npy[i].path, NULL, &f);
        tap_ok(st == IMP_E_SCENE && strstr(imp_last_error(kit_ctx), npy[i].want) &&
                   strstr(imp_last_error(kit_ctx), npy[i].path),
               "%s # %s", npy[i].want, imp_last_error(kit_ctx));
    }
    spill("a.npy", (const unsigned char *)"PK\x03\x04 an .npz, say", 17);
    tap_ok(imp_field_read(kit_ctx, "a.npy", NULL, &f) == IMP_E_SCENE &&
               strstr(imp_last_error(kit_ctx), "not an NPY file"),
           "no .npy # %s", imp_last_error(kit_ctx));
    remove("a.npy");
    unsigned char vol[48 + 32] = "VOL\x03\x01";
    const int32_t sizes[4] = {2, -3, 2, 1};
    memcpy(vol + 8, sizes, sizeof sizes);
    spill("a.vol", vol, sizeof vol);
    tap_ok(imp_field_read(kit_ctx, "a.vol", NULL, &f) == IMP_E_SCENE &&
               strstr(imp_last_error(kit_ctx), ": -3 samples along y: 2 to 8193"),
           "a negative size # %s", imp_last_error(kit_ctx));
    remove("a.vol");
}

static const char problem[] =
    "<scene version='3.0.0'>\n"
    "<medium type='graded'>\n"
    " <volume type='grid'><integer name='cells' value='5'/></volume>\n"
    " <volume type='plume'><float name='n0' value='0'/><float name='b' value='0.1'/>"
    "<float name='width' value='0.4'/></volume>\n"
    " <volume type='luneburg' name='truth'><float name='radius' value='0.9'/></volume>\n"
    " <integer name='hold_rim' value='2'/><string name='hold' value='x y'/>\n"
    " <float name='smoothness' value='1e-6'/><float name='step' value='0.1'/>\n"
    " <surface type='box'/>\n"
    "</medium>\n"
    "<rays type='beam'><integer name='views' value='3'/><integer name='count' "
    "value='16'/>"
    "<float name='radius' value='0.5'/><float name='start' value='-0.7'/>"
    "<surface type='plane'><string name='event' value='tap'/></surface>"
    "<target type='points'><boolean name='from_truth' value='true'/></target>"
    "<target type='focus'><integer name='tap' value='0'/></target></rays>\n"
    "<rays type='point'><float name='angle' value='20'/><integer name='count' value='9'/>"
    "<string name='pattern' value='fan'/></rays>\n"
    "<target type='wavefront'><float name='plane' value='2'/></target>\n"
    "</scene>\n";

static void problems(void)
{
    imp_bend *b;
    double value, *g;
    KIT_CHECK(imp_bend_load_string(kit_ctx, problem, strlen(problem), "p", NULL, &b));
    tap_ok(imp_bend_n_rays(b) == 3 * 16 + 9 && imp_bend_n_bundles(b) == 4 &&
               imp_bend_n_targets(b) == 7 && b->options.n_taps == 3,
           "problem: %zu rays, %d bundles, %zu targets", imp_bend_n_rays(b),
           imp_bend_n_bundles(b), imp_bend_n_targets(b));
    struct imp_bend_rays r = IMP_BEND_RAYS_INIT;
    imp_bend_get_rays(b, &r);
    const double want[3] = {-0.7 * sin(IMP_PI / 3), 0, -0.7 * cos(IMP_PI / 3)};
    double mid[3] = {0};
    for (int i = 16; i < 32; i++)
        for (int k = 0; k < 3; k++) mid[k] += r.x[i][k] / 16;
    tap_ok(fabs(mid[0] - want[0]) + fabs(mid[1] - want[1]) + fabs(mid[2] - want[2]) <
                   0.1 &&
               fabs(r.d[20][0] - sin(IMP_PI / 3)) < 1e-12,
           "second view: turned by 60 degrees");
    g = calloc(imp_field_n_theta(imp_bend_field(b)), sizeof *g);
    KIT_CHECK(imp_bend_objective(b, &value, g, NULL, NULL));
    const struct imp_check_row *rows;
    size_t n_rows;
    int ok = 1;
    KIT_CHECK(imp_bend_check(b, &rows, &n_rows));
    for (size_t i = 0; i < n_rows; i++) {
        if (!strcmp(rows[i].method, "dot") || !strcmp(rows[i].method, "transpose") ||
            (!strcmp(rows[i].method, "difference") && rows[i].step == 1e-6))
            ok = ok && rows[i].error < 1e-5;
    }
    tap_ok(ok && n_rows > 8, "problem checks itself # %zu rows", n_rows);
    free(g);
    imp_bend_destroy(b);

    int good = 0, bad = 0;
    const size_t n = strlen(problem);
    for (int i = 0; i < 600; i++) { /* a letter or two changed */
        char text[sizeof problem];
        memcpy(text, problem, sizeof text);
        for (int k = 0; k <= i % 3; k++) {
            static const char letters[] = "<>'/=0123456789-.eabxz \n$";
            text[(size_t)(kit_u(530 + k, i) * (double)n)] =
                letters[(size_t)(kit_u(540 + k, i) * (sizeof letters - 1))];
        }
        b = NULL;
        if (imp_bend_load_string(kit_ctx, text, n, "p", NULL, &b) == IMP_OK && b) {
            good++;
            imp_bend_destroy(b);
        } else {
            bad += imp_last_error(kit_ctx)[0] != 0 && b == NULL;
        }
    }
    tap_ok(good + bad == 600 && bad > 300,
           "damaged problems: %d refused with a message, %d read", bad, good);
}

/* Densities of air, K = 2.26e-4 m^3/kg: index 1 + K rho; from a file, in a problem. */
static void densities(void)
{
    const double K = 2.26e-4;
    struct imp_field_grid g = IMP_FIELD_GRID_INIT;
    imp_field *f;
    double rho[6 * 6 * 6], eta, bar[9 * 9 * 9], back[6 * 6 * 6], left = 0, right = 0;
    for (int k = 0; k < 3; k++) g.cells[k] = 5, g.lo[k] = -1, g.hi[k] = 1;
    for (int i = 0; i < 216; i++) rho[i] = 1.2 * kit_u(560, i);
    g.gladstone_dale = K;
    KIT_CHECK(imp_field_grid_create(kit_ctx, &g, 1, &f));
    KIT_CHECK(imp_field_set_samples(f, rho));
    const double node[3] = {-1 + 2 * 0.4, -1 + 4 * 0.4, -1 + 0.4};
    imp_field_eval(f, node, &eta, NULL, NULL);
    tap_near(eta, 1 + K * rho[2 + 6 * (4 + 6 * 1)], 0, 1e-15, "index of a density");
    /* Transpose: <theta_bar, d theta/d rho rho_dot> with rho_dot = rho: theta - theta(0).
     */
    for (size_t i = 0; i < f->n_theta; i++)
        bar[i] = kit_pm(561, i), left += bar[i] * (f->theta[i] - 1);
    KIT_CHECK(imp_field_samples_vjp(f, bar, back));
    for (int i = 0; i < 216; i++) right += back[i] * rho[i];
    tap_near(left, right, 0, 1e-13, "densities: transpose"); /* theta is near 1 */
    rho[7] = -1e5;
    tap_ok(imp_field_set_samples(f, rho) == IMP_E_ARG, "no index # %s",
           imp_last_error(kit_ctx));
    imp_field_destroy(f);
    g.gladstone_dale = NAN;
    tap_ok(imp_field_grid_create(kit_ctx, &g, 1, &f) == IMP_E_ARG, "K is NaN # %s",
           imp_last_error(kit_ctx));
    g.gladstone_dale = 0;
    KIT_CHECK(imp_field_grid_create(kit_ctx, &g, 1.225, &f)); /* numbers of a file */
    KIT_CHECK(imp_field_write(f, "rho.npy"));
    imp_field_destroy(f);
    static const char xml[] =
        "<scene version='3.0.0'><medium type='graded'><volume type='grid'>"
        "<string name='filename' value='rho.npy'/><float name='gladstone_dale' "
        "value='2.26e-4'/></volume></medium><rays type='beam'><integer name='count' "
        "value='3'/></rays></scene>";
    imp_bend *b;
    KIT_CHECK(imp_bend_load_string(kit_ctx, xml, sizeof xml - 1, "rho.xml", NULL, &b));
    imp_field_eval(imp_bend_field(b), node, &eta, NULL, NULL);
    tap_near(eta, 1 + K * 1.225, 0, 1e-14, "a file of densities in a problem");
    imp_bend_destroy(b);
    remove("rho.npy");
}

/* Profiles that could not be read are not written. */
static void too_far(void)
{
    struct imp_field_radial r = IMP_FIELD_RADIAL_INIT;
    struct imp_field_rz z = IMP_FIELD_RZ_INIT;
    imp_field *f;
    for (int k = 0; k < 10; k++) {
        const bool flat = k >= 5, fine = k % 5 == 4;
        const double change = k % 5 == 1 ? 2e12 : k % 5 == 3 ? 0.9e-12 : 1;
        if (flat) {
            z = (struct imp_field_rz)IMP_FIELD_RZ_INIT;
            if (k == 6) z.centre[1] = -change;
            if (k == 8) z.lo = 0, z.hi = change;
            if (k == 9) z.lo = -1e12, z.radius = 1e-12;
            KIT_CHECK(imp_field_rz_create(kit_ctx, &z, 1, &f));
        } else {
            r = (struct imp_field_radial)IMP_FIELD_RADIAL_INIT;
            if (k == 1) r.centre[1] = -change;
            if (k == 3) r.radius = change;
            if (k == 4) r.centre[0] = 1e12, r.radius = 1e-12;
            KIT_CHECK(imp_field_radial_create(kit_ctx, &r, 1, &f));
        }
        if (k % 5 == 0) f->theta[f->n_theta - 1] = 1.1e12;
        if (k % 5 == 2) f->theta[0] = NAN;
        remove("far.txt");
        const enum imp_status st = imp_field_write(f, "far.txt");
        imp_field *back = NULL;
        if (fine) {
            if (st == IMP_OK) KIT_CHECK(imp_field_read(kit_ctx, "far.txt", NULL, &back));
            tap_ok(back != NULL, "%s at the bounds: read again", flat ? "rz" : "radial");
        } else {
            tap_ok(st == IMP_E_UNSUPPORTED && access("far.txt", F_OK) != 0 &&
                       strstr(imp_last_error(kit_ctx), "far.txt: not written"),
                   "%s, case %d: not written # %s", flat ? "rz" : "radial", k % 5,
                   imp_last_error(kit_ctx));
        }
        imp_field_destroy(back);
        imp_field_destroy(f);
    }
    remove("far.txt");
}

int main(void)
{
    char folder[] = "/tmp/bend_files.XXXXXX";
    if (!mkdtemp(folder) || chdir(folder)) return 99;
    kit_begin(1);
    imp_field *f = kit_grid(IMP_FIELD_SPLINE, IMP_FIELD_ETA, 5, 1, 0.05);
    double s[6 * 7 * 8]; /* through samples: natural ends, which files imply */
    for (int i = 0; i < 6 * 7 * 8; i++) s[i] = 1.2 + 0.1 * kit_u(550, i);
    KIT_CHECK(imp_field_set_samples(f, s));
    round_trip("a.npy", f, 1e-13);
    imp_field_destroy(f);
    f = kit_grid(IMP_FIELD_TRILINEAR, IMP_FIELD_ETA, 5, 1, 0.05);
    round_trip("a.vol", f, 1e-6);
    imp_field_destroy(f);
    const char *name;
    f = kit_field(12, &name);
    round_trip("a.txt", f, 1e-15);
    imp_field_destroy(f);
    too_far();
    densities();
    fortran_order();
    messages();
    problems();
    imp_context_destroy(kit_ctx);
    if (chdir("/") == 0) rmdir(folder);
    return tap_done();
}
