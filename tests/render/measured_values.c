/* SPDX-License-Identifier: Apache-2.0
 *
 * Measured materials of the RGL format against Mitsuba 3.9.1, direction by direction:
 * values, densities and draws, kept in peer/measured.txt by
 * bench/peers/measured_values.py. Its numbers are single precision.
 *
 *     measured_values --write DIR      the files that it reads */
#include "imp_measured.h"
#include "imp_scene.h"
#include "imp_tap.h"
#include "kind/bsdf/lambert.h"
#include "kind/bsdf/measured.h"
#include "scene/scene.h"
#include <math.h>
#include <unistd.h>

#define TOLERANCE 1e-4

static const struct {
    const char *name;
    struct rgl_model model;
} files[] = {{"isotropic", {{0.35, 0.35}, 0, true, false, true}},
             {"plain", {{0.35, 0.35}, 0, true, false, false}},
             {"whole", {{0.3, 0.6}, 1, true, false, true}},
             {"half", {{0.3, 0.6}, 2, true, false, true}},
             {"quarter", {{0.5, 0.25}, 4, true, false, true}},
             {"spectral", {{0.35, 0.35}, 0, false, true, true}},
             {"half_spectral", {{0.3, 0.6}, 2, true, true, true}}};

static imp_context *ctx;

static imp_scene *scene_of(size_t k, enum imp_color_mode mode)
{
    char file[96], xml[400];
    snprintf(file, sizeof file, "measured_values_%d.bsdf", (int)getpid());
    if (!rgl_write(file, &files[k].model)) exit(99);
    snprintf(xml, sizeof xml,
             "<scene version='3.0.0'><shape type='sphere'><bsdf type='measured'><string "
             "name='filename' value='%s'/></bsdf></shape></scene>",
             file);
    imp_scene *s = test_scene_text(ctx, xml, mode);
    remove(file);
    return s;
}

struct tally {
    double value, density, draw, planted;
    int n, lit;
};

static double apart(double a, double b) { return fabs(a - b) / (fabs(b) + 1e-3); }

/* `value` WO WI F[lanes] P, `draw` WO U1 U2 WI; at wavelengths 450, 500, 550, 600. */
static void row_check(const struct imp_bsdf *b, bool spectral, const char *line,
                      struct tally *t)
{
    double v[12];
    imp_spec in[IMP_INPUTS_MAX], f;
    const struct imp_carried carried = {4, {450, 500, 550, 600}};
    const struct imp_texcoord at = {.carried = spectral ? &carried : NULL};
    const int lanes = spectral ? 4 : 3;
    const bool draw = strncmp(line, "draw", 4) == 0;
    const char *p = strchr(line, ' ');
    int n = 0;
    for (char *end; n < 12 && p; n++, p = end) {
        v[n] = strtod(p, &end);
        if (end == p) break;
    }
    imp__inputs_eval(b->input, b->n_in, &at, in);
    struct imp_dirs d = {
        imp__normalize(imp__v3(v[0], v[1], v[2])), {0}, IMP_SMOOTH, false};
    if (draw && n == 8) {
        const bool drawn = b->ops->sample(b, in, (double[3]){0.99, v[3], v[4]}, &d);
        const imp_v3 wi = imp__v3(v[5], v[6], v[7]);
        t->draw = fmax(t->draw, drawn ? imp__length(d.wi - wi) : wi[2] > 1e-3);
        t->n++;
    } else if (!draw && n == 7 + lanes) {
        d.wi = imp__normalize(imp__v3(v[3], v[4], v[5]));
        b->ops->eval(b, in, &d, &f);
        const double p_all = b->ops->pdf(b, in, &d);
        for (int c = 0; c < lanes; c++) {
            t->value = fmax(t->value, apart(f[c], v[6 + c]));
            t->planted = fmax(t->planted, apart(1.001 * f[c], v[6 + c]));
        }
        t->density =
            fmax(t->density, apart((p_all - IMP_MEASURED_SHARE * imp__lambert(&d)) /
                                       (1 - IMP_MEASURED_SHARE),
                                   v[6 + lanes]));
        t->n++;
        t->lit += v[6] > 0;
    }
}

static void report(size_t k, const struct tally *t, imp_scene *scene)
{
    if (!scene) return;
    tap_ok(t->value < TOLERANCE && t->density < TOLERANCE && t->draw < TOLERANCE &&
               t->lit > 20 && t->n > 60,
           "%s # values %.1e, densities %.1e, draws %.1e off, of %d rows", files[k].name,
           t->value, t->density, t->draw, t->n);
    tap_ok(t->planted > TOLERANCE, "0.1 %% more is caught # %.1e", t->planted);
    imp_scene_destroy(scene);
}

/* Colours of a file that has spectra alone, and wavelengths of one that has rgb alone. */
static void other_modes(void)
{
    static const double wo[3] = {0.3, 0.2, 0.8}, wi[3] = {-0.4, 0.1, 0.7};
    const struct imp_dirs d = {imp__normalize(imp__v3(wo[0], wo[1], wo[2])),
                               imp__normalize(imp__v3(wi[0], wi[1], wi[2])), IMP_SMOOTH,
                               false};
    imp_spec in[IMP_INPUTS_MAX], f[4];
    for (int k = 0; k < 4; k++) {
        static const enum imp_color_mode modes[] = {IMP_RGB, IMP_MONO, IMP_SPECTRAL,
                                                    IMP_RGB};
        const struct imp_carried carried = {4, {450, 500, 550, 600}};
        const struct imp_texcoord at = {.carried = k == 2 ? &carried : NULL};
        imp_scene *s = scene_of(k < 2 ? 5 : 0, modes[k]);
        const struct imp_bsdf *b = s->bsdfs[0];
        imp__inputs_eval(b->input, b->n_in, &at, in);
        b->ops->eval(b, in, &d, &f[k]);
        imp_scene_destroy(s);
    }
    const double y = 0.212671 * f[0][0] + 0.715160 * f[0][1] + 0.072169 * f[0][2];
    tap_near(f[1][0], y, 1e-5, 0, "a file of spectra: mono is the luminance of rgb");
    tap_ok(f[0][0] > f[0][1] && f[0][1] > f[0][2] && f[0][2] > 0,
           "and its colour is reddish as the file # %g %g %g", f[0][0], f[0][1], f[0][2]);
    tap_ok(f[2][0] > 0.9 * f[3][2] && f[2][0] < f[2][3] && f[2][3] < 1.1 * f[3][0],
           "a file of rgb has wavelengths # %g %g; %g %g", f[2][0], f[2][3], f[3][2],
           f[3][0]);
}

int main(int argc, char **argv)
{
    char line[512], name[64];
    if (argc == 3 && strcmp(argv[1], "--write") == 0) {
        for (size_t k = 0; k < imp_count(files); k++) {
            snprintf(line, sizeof line, "%s/%s.bsdf", argv[2], files[k].name);
            if (!rgl_write(line, &files[k].model)) return 1;
        }
        return 0;
    }
    ctx = test_context(1);
    FILE *f = fopen(IMP_SCENES "/../tests/render/peer/measured.txt", "r");
    if (!f) return 99;
    imp_scene *scene = NULL;
    struct tally t = {0};
    size_t k = 0;
    while (fgets(line, sizeof line, f)) {
        if (sscanf(line, "file %63s", name) == 1) {
            report(k, &t, scene);
            t = (struct tally){0};
            for (k = 0; k < imp_count(files) && strcmp(files[k].name, name) != 0;) k++;
            if (k == imp_count(files)) return 99;
            scene = scene_of(k, files[k].model.spectra ? IMP_SPECTRAL : IMP_RGB);
        } else if (line[0] != '#' && scene) {
            row_check(scene->bsdfs[0], files[k].model.spectra, line, &t);
        }
    }
    report(k, &t, scene);
    fclose(f);
    other_modes();
    imp_context_destroy(ctx);
    return tap_done();
}
