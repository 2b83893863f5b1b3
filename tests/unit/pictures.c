/* SPDX-License-Identifier: Apache-2.0
 *
 * Picture files: what is written comes back, and a write that fails leaves what was
 * there. */
#include "picture_kit.h"
#include <signal.h>
#include <sys/resource.h>
#include <sys/stat.h>

static double difference(const float *a, const float *b, size_t n)
{
    double worst = 0;
    for (size_t i = 0; i < n; i++) {
        const double d = fabs((double)a[i] - (double)b[i]);
        worst = d >= worst || isnan(d) ? d : worst;
    }
    return worst;
}

/* ---- Round trips --------------------------------------------------------------- */

static void check_exr(void)
{
    static const struct {
        const char *names, *back;
        int w, h, half;
    } cases[] = {{"R,G,B", "R,G,B", 37, 23, 0},
                 {"R,G,B", "R,G,B", 37, 23, 1},
                 {"Y", "Y", 5, 40, 0},
                 {"R,G,B,A", "R,G,B,A", 8, 8, 0},
                 {"X,Y,Z", "X,Y,Z", 3, 2, 0},
                 {"Y", "Y", 1, 1, 1},
                 {"R,G,B,albedo.R,albedo.G,albedo.B,depth,nn.X,nn.Y,nn.Z",
                  "R,G,B,depth,albedo.R,albedo.G,albedo.B,nn.X,nn.Y,nn.Z", 19, 33, 0}};
    for (size_t i = 0; i < imp_count(cases); i++) {
        imp_film *f = sample(cases[i].w, cases[i].h, cases[i].names, true), *g = NULL;
        struct imp_write_options o = IMP_WRITE_OPTIONS_INIT;
        o.half = cases[i].half;
        o.standard_error = 1;
        f->spp = 12345678901;
        f->dropped = 3;
        enum imp_status st = imp_film_set_text(f, "command", "importon render a.xml");
        if (st == IMP_OK)
            st = imp_film_set_text(f, "a key that is longer than 31 characters",
                                   "\xc3\xa9");
        if (st == IMP_OK) st = imp_film_write(f, in_folder("a.exr"), &o);
        if (st == IMP_OK) st = imp_film_read(ctx, in_folder("a.exr"), &g);
        tap_ok(st == IMP_OK, "EXR %s %d x %d%s # %s", cases[i].names, cases[i].w,
               cases[i].h, cases[i].half ? " half" : "", st ? imp_last_error(ctx) : "");
        if (st == IMP_OK) {
            char names[256] = "";
            double worst = 0, worst_se = g->se ? 0 : 1;
            for (int c = 0; c < g->channels; c++) {
                sprintf(names + strlen(names), "%s%s", c ? "," : "", g->names[c]);
                const int k = imp__film_find(f, g->names[c]);
                for (size_t p = 0; k >= 0 && p < (size_t)(g->width * g->height); p++) {
                    const size_t a = p * (size_t)f->channels + (size_t)k,
                                 b = p * (size_t)g->channels + (size_t)c;
                    worst = fmax(worst, fabs((double)f->mean[a] - (double)g->mean[b]));
                    if (g->se)
                        worst_se =
                            fmax(worst_se, fabs((double)f->se[a] - (double)g->se[b]));
                }
            }
            tap_ok(strcmp(names, cases[i].back) == 0, "its channels # %s", names);
            tap_ok(worst <= (o.half ? 3 * 0x1p-11 : 0) && worst_se <= (o.half ? 0.05 : 0),
                   "its numbers # error %.2e, of se %.2e", worst, worst_se);
            tap_ok(g->spp == f->spp && g->dropped == 3, "spp and dropped walks");
            tap_ok(g->n_texts == 2 &&
                       strcmp(g->texts[0].value, "importon render a.xml") == 0 &&
                       strcmp(g->texts[1].value, "\xc3\xa9") == 0,
                   "its texts");
        }
        imp_film_destroy(f);
        imp_film_destroy(g);
    }
    imp_film *f = sample(2, 1, "Y", false), *g = NULL;
    struct imp_write_options o = IMP_WRITE_OPTIONS_INIT;
    o.half = 1;
    f->mean[0] = 1e9f;
    f->mean[1] = -INFINITY;
    if (imp_film_write(f, in_folder("h.exr"), &o) == IMP_OK &&
        imp_film_read(ctx, in_folder("h.exr"), &g) == IMP_OK)
        tap_ok(g->mean[0] == 65504 && g->mean[1] == -INFINITY, "half saturates # %g",
               g->mean[0]);
    imp_film_destroy(f);
    imp_film_destroy(g);
}

static void check_raw(void)
{
    for (int i = 0; i < 4; i++) {
        const char *path = in_folder(i < 2 ? "a.pfm" : "a.npy");
        imp_film *f = sample(7, 5, i % 2 ? "Y" : "R,G,B", false), *g = NULL;
        enum imp_status st = imp_film_write(f, path, NULL);
        if (st == IMP_OK) st = imp_film_read(ctx, path, &g);
        tap_ok(st == IMP_OK && g->channels == f->channels && g->width == 7 &&
                   g->height == 5 &&
                   difference(f->mean, g->mean, imp__film_values(f)) == 0,
               "%s of %s # %s", i < 2 ? "PFM" : "NPY", i % 2 ? "Y" : "R,G,B",
               st ? imp_last_error(ctx) : "");
        imp_film_destroy(f);
        imp_film_destroy(g);
    }
    static const unsigned char big[] =
        "PF\n1 2\n1.0\n"
        "\x3f\x80\0\0\x40\0\0\0\x40\x40\0\0\xbf\x80\0\0\xc0\0\0\0\xc0\x40\0\0";
    struct imp_bytes b = {(unsigned char *)big, sizeof big - 1, 0};
    imp_film *g = NULL;
    bool srgb;
    tap_ok(imp__image_parse(ctx, "b.pfm", &b, &g, &srgb) == IMP_OK && g->mean[0] == -1 &&
               g->mean[3] == 1 && g->mean[5] == 3,
           "big-endian PFM, rows from the bottom");
    imp_film_destroy(g);
    static const char npy[] =
        "\x93NUMPY\x01\x00\x40\x00{'descr': '<f8', 'fortran_order': False, "
        "'shape': (1, 2), }    \n\0\0\0\0\0\0\xf0\x3f\0\0\0\0\0\0\0\x40";
    b = (struct imp_bytes){(unsigned char *)npy, sizeof npy - 1, 0};
    g = NULL;
    const enum imp_status st = imp__image_parse(ctx, "b.npy", &b, &g, &srgb);
    tap_ok(st == IMP_OK && g->width == 2 && g->mean[0] == 1 && g->mean[1] == 2,
           "NPY of doubles # %s", st ? imp_last_error(ctx) : "");
    imp_film_destroy(g);

    /* numpy.asfortranarray of a (2, 3, 3) array whose element (y, x, c) is 100 y + 10 x + c.
     */
    enum { H = 2, W = 3, C = 3 };
    char file[128 + 4 * H * W * C];
    memset(file, ' ', 128);
    memcpy(file, "\x93NUMPY\x01\x00\x76\x00", 10);
    const int n = snprintf(file + 10, 118,
                           "{'descr': '<f4', 'fortran_order': True, "
                           "'shape': (2, 3, 3), }");
    file[10 + n] = ' ';
    file[127] = '\n';
    for (int c = 0, at = 128; c < C; c++)
        for (int x = 0; x < W; x++)
            for (int y = 0; y < H; y++, at += 4)
                memcpy(file + at, &(float){(float)(100 * y + 10 * x + c)}, 4);
    b = (struct imp_bytes){(unsigned char *)file, sizeof file, 0};
    g = NULL;
    const enum imp_status fortran = imp__image_parse(ctx, "f.npy", &b, &g, &srgb);
    int wrong = fortran != IMP_OK || g->width != W || g->height != H || g->channels != C;
    for (int i = 0; !wrong && i < H * W * C; i++)
        wrong += g->mean[i] != (float)(100 * (i / (W * C)) + 10 * (i / C % W) + i % C);
    tap_ok(!wrong, "NPY in Fortran's order # %s", fortran ? imp_last_error(ctx) : "");
    imp_film_destroy(g);
}

/* Whole numbers are those of a picture file: sRGB, alpha linear. */
static void check_npy_integers(void)
{
    static const unsigned char bytes[] = {0, 10, 188, 255, 64, 128, 255, 51};
    static const struct {
        const char *dictionary;
        int C, bytes;
        const char *refused;
    } cases[] = {
        {"{'descr': '|u1', 'fortran_order': False, 'shape': (1, 2, 4), }", 4, 1, NULL},
        {"{'descr': '|u1', 'fortran_order': True, 'shape': (2, 4), }", 1, 1, NULL},
        {"{'descr': '<u1', 'fortran_order': False, 'shape': (1, 2, 4), }", 4, 1, NULL},
        {"{'shape': (2, 2), 'fortran_order': False, 'descr': '<u2'}", 1, 2, NULL},
        {"{'descr': '<i4', 'fortran_order': False, 'shape': (1, 2), }", 0, 0,
         "a.npy: an array of '<i4': pictures are '<f4' or '<f8' (linear), '|u1' or "
         "'<u2' (sRGB); convert it with astype"},
        {"{'descr': '>u2', 'fortran_order': False, 'shape': (1, 2), }", 0, 0,
         "a.npy: an array of '>u2': pictures are '<f4' or '<f8' (linear), '|u1' or "
         "'<u2' (sRGB); convert it with astype"},
        {"{'descr': [('x', '|u1')], 'fortran_order': False, 'shape': (1, 2), }", 0, 0,
         "a.npy: an array of '': pictures are '<f4' or '<f8' (linear), '|u1' or "
         "'<u2' (sRGB); convert it with astype"},
        {"{'descr': '<u2', 'fortran_order': False, 'shape': (2, 3), }", 0, 0,
         "a.npy: cut off"}};
    for (size_t i = 0; i < imp_count(cases); i++) {
        char path[256];
        snprintf(path, sizeof path, "%s", in_folder("a.npy"));
        FILE *to = fopen(path, "wb");
        const size_t n = strlen(cases[i].dictionary);
        fprintf(to, "%cNUMPY%c%c%c%c%s", 0x93, 1, 0, (int)n, 0, cases[i].dictionary);
        fwrite(bytes, 1, sizeof bytes, to);
        fclose(to);
        imp_film *f = NULL;
        const enum imp_status st = imp_film_read(ctx, path, &f);
        if (cases[i].refused) {
            const char *said = strstr(imp_last_error(ctx), "a.npy");
            tap_ok(st == IMP_E_SCENE && said && !strcmp(said, cases[i].refused),
                   "%s is refused # %s", cases[i].dictionary, imp_last_error(ctx));
            imp_film_destroy(f);
            continue;
        }
        double worst = st == IMP_OK ? 0 : INFINITY;
        for (size_t k = 0; st == IMP_OK && k < imp__film_values(f); k++) {
            const size_t C = (size_t)cases[i].C;
            /* (2, 4) by columns: element (y, x) is byte y + 2 x. */
            const size_t at = i == 1 ? k / 4 + 2 * (k % 4) : k;
            const double v = cases[i].bytes == 1
                                 ? bytes[at] / 255.
                                 : (bytes[2 * at] + 256 * bytes[2 * at + 1]) / 65535.;
            const double linear =
                v <= 0.04045 ? v / 12.92 : pow((v + 0.055) / 1.055, 2.4);
            const double want = C == 4 && k % C == 3 ? v : linear;
            worst = fmax(worst, fabs((double)f->mean[k] - want));
        }
        tap_ok(worst < 1e-6 && f->channels == cases[i].C, "%s # off by %g %s",
               cases[i].dictionary, worst, st ? imp_last_error(ctx) : "");
        imp_film_destroy(f);
    }
}

static void check_hdr(void)
{
    for (int i = 0; i < 2; i++) {
        imp_film *f = sample(11, 4, i ? "Y" : "R,G,B", false), *g = NULL;
        for (size_t k = 0; k < imp__film_values(f); k++)
            f->mean[k] = (float)exp(3 * (double)f->mean[k]);
        f->mean[0] = 0;
        enum imp_status st = imp_film_write(f, in_folder("a.hdr"), NULL);
        if (st == IMP_OK) st = imp_film_read(ctx, in_folder("a.hdr"), &g);
        double worst =
            g ? 0 : 1; /* half a step of eight bits of the brightest component */
        for (int p = 0; g && p < 44; p++) {
            double most = 0, error = 0;
            for (int c = 0; c < 3; c++) {
                const double want = (double)f->mean[p * f->channels + (i ? 0 : c)];
                most = fmax(most, want);
                error = fmax(error, fabs((double)g->mean[3 * p + c] - want));
            }
            worst = fmax(worst, most > 0 ? error / most : error);
        }
        tap_ok(worst <= 1.001 / 256, "HDR of %s # relative error %.2e %s",
               i ? "Y" : "R,G,B", worst, st ? imp_last_error(ctx) : "");
        imp_film_destroy(f);
        imp_film_destroy(g);
    }
    static const unsigned char runs[] =
        "#?RADIANCE\nEXPOSURE=1\nFORMAT=32-bit_rle_rgbe\n\n"
        "-Y 1 +X 8\n\x02\x02\x00\x08\x88\x80\x88\x40\x02\x00\x01\x86\x20\x88\x81";
    struct imp_bytes b = {(unsigned char *)runs, sizeof runs - 1, 0};
    imp_film *g = NULL;
    bool srgb = true;
    const enum imp_status st = imp__image_parse(ctx, "r.hdr", &b, &g, &srgb);
    tap_ok(st == IMP_OK && !srgb && g->mean[21] == 128.5f / 128 &&
               g->mean[22] == 64.5f / 128 && g->mean[2] == 0.5f / 128 &&
               g->mean[5] == 1.5f / 128 && g->mean[23] == 32.5f / 128,
           "HDR of runs and literals # %s", st ? imp_last_error(ctx) : "");
    imp_film_destroy(g);
}

static void check_png(void)
{
    imp_film *f = sample(16, 16, "R,G,B", false), *g = NULL;
    for (size_t i = 0; i < 256; i++)
        for (size_t c = 0; c < 3; c++)
            f->mean[3 * i + c] = (float)((double)(i + c) / 300);
    enum imp_status st = imp_film_write(f, in_folder("a.png"), NULL);
    if (st == IMP_OK) st = imp_film_read(ctx, in_folder("a.png"), &g);
    tap_ok(st == IMP_OK, "PNG # %s", st ? imp_last_error(ctx) : "");
    /* Half a code value at the steep end of the curve: 0.5/255 * dL/dc(1) = 0.5/255
     * * 2.27. */
    if (g)
        tap_near(difference(f->mean, g->mean, 768), 0, 0, 0.5 / 255 * 2.28,
                 "sRGB there and back");
    imp_film_destroy(g);

    struct imp_write_options o = IMP_WRITE_OPTIONS_INIT;
    o.exposure = 1;
    g = NULL;
    if (imp_film_write(f, in_folder("a.png"), &o) == IMP_OK &&
        imp_film_read(ctx, in_folder("a.png"), &g) == IMP_OK)
        tap_ok(fabs(g->mean[3 * 60] - 0.4f) < 0.01 && g->mean[3 * 200] == 1,
               "one stop brighter, clipped");
    imp_film_destroy(g);
    imp_film_destroy(f);

    f = sample(3, 1, "Y", false);
    f->mean[0] = -2, f->mean[1] = 0, f->mean[2] = 2;
    o = (struct imp_write_options)IMP_WRITE_OPTIONS_INIT;
    o.diverging = 1;
    g = NULL;
    if (imp_film_write(f, in_folder("d.png"), &o) == IMP_OK &&
        imp_film_read(ctx, in_folder("d.png"), &g) == IMP_OK)
        tap_ok(g->channels == 3 && g->mean[2] > g->mean[0] && g->mean[3] == 1 &&
                   g->mean[4] == 1 && g->mean[6] > g->mean[8],
               "blue, white, red");
    imp_film_destroy(g);
    imp_film_destroy(f);
    f = sample(2, 2, "Y", false);
    tap_ok(imp_film_write(f, in_folder("a.tiff"), NULL) == IMP_E_ARG,
           "unknown extensions are refused");
    imp_film_destroy(f);
}

/* ---- Failing writes -------------------------------------------------------------------
 */

static void check_atomic(void)
{
    imp_film *f = sample(64, 64, "R,G,B", false), *g = NULL;
    struct stat info;
    bool ok = imp_film_write(f, in_folder("keep.exr"), NULL) == IMP_OK;
    f->mean[0] = 77;
    /* A limit on the size of files fails the write half way, as a full disk does. */
    struct rlimit old, low;
    getrlimit(RLIMIT_FSIZE, &old);
    low = old;
    low.rlim_cur = 1000;
    setrlimit(RLIMIT_FSIZE, &low);
    const enum imp_status st = imp_film_write(f, in_folder("keep.exr"), NULL);
    setrlimit(RLIMIT_FSIZE, &old);
    tap_ok(ok && st == IMP_E_IO, "a write that cannot finish is an error # %s",
           imp_last_error(ctx));
    ok = imp_film_read(ctx, in_folder("keep.exr"), &g) == IMP_OK && g->mean[0] != 77;
    tap_ok(ok, "and the old file stays");
    char command[300];
    snprintf(command, sizeof command, "ls %s | grep -q tmp", folder);
    tap_ok(system(command) != 0, "and nothing else is left");
    imp_film_destroy(g);
    tap_ok(imp_film_write(f, "/nowhere/at/all.exr", NULL) == IMP_E_IO,
           "no such folder # %s", imp_last_error(ctx));
    if (access("/dev/full", W_OK) == 0) { /* through a link whose name has an extension */
        if (symlink("/dev/full", in_folder("full.exr")) == 0)
            tap_ok(imp_film_write(f, in_folder("full.exr"), NULL) == IMP_E_IO,
                   "a full device # %s", imp_last_error(ctx));
    }
    if (symlink("keep.exr", in_folder("link.exr")) == 0) {
        ok = imp_film_write(f, in_folder("link.exr"), NULL) == IMP_OK &&
             lstat(in_folder("link.exr"), &info) == 0 && S_ISLNK(info.st_mode);
        g = NULL;
        ok = ok && imp_film_read(ctx, in_folder("keep.exr"), &g) == IMP_OK &&
             g->mean[0] == 77;
        tap_ok(ok, "links are written through");
        imp_film_destroy(g);
    }
    imp_film_destroy(f);
}

int main(void)
{
    if (!kit_open()) return 1;
    signal(SIGXFSZ, SIG_IGN);
    check_exr();
    check_raw();
    check_npy_integers();
    check_hdr();
    check_png();
    check_atomic();
    return kit_close();
}
