/* SPDX-License-Identifier: Apache-2.0
 *
 * Materials whose draws are a function of the random numbers, as the paper has it, against
 * Mitsuba 3.9.1, direction by direction: values, densities and draws, kept in
 * peer/drawn.txt by bench/peers/drawn_values.py. Its numbers are single precision.
 *
 *     drawn_values --write DIR      the scenes that it reads */
#include "imp_measured.h"
#include "imp_scene.h"
#include "imp_tap.h"
#include "kind/bsdf/lambert.h"
#include "kind/bsdf/measured.h"
#include "scene/scene.h"
#include <math.h>
#include <unistd.h>

#define TOLERANCE 1e-4
/* Its Bessel function is cut after a few terms: up to 0.6 % off between 6 and 30. */
#define TOLERANCE_HAIR 7e-3

#define HAIR(m, n, rest)                                                                 \
    "<bsdf type='hair'><float name='longitudinal_roughness' value='" m "'/><float "      \
    "name='azimuthal_roughness' value='" n "'/>" rest "</bsdf>"
#define SIGMA "<rgb name='sigma_a' value='.1,.4,.8'/><float name='scale' value='1.5'/>"

static const struct peer_case {
    const char *name, *bsdf; /* NULL: measured, of this model */
    double tolerance;
    struct rgl_model model;
} cases[] = {
    {"isotropic", NULL, TOLERANCE, {{0.35, 0.35}, 0, true, false, true}},
    {"plain", NULL, TOLERANCE, {{0.35, 0.35}, 0, true, false, false}},
    {"whole", NULL, TOLERANCE, {{0.3, 0.6}, 1, true, false, true}},
    {"half", NULL, TOLERANCE, {{0.3, 0.6}, 2, true, false, true}},
    {"quarter", NULL, TOLERANCE, {{0.5, 0.25}, 4, true, false, true}},
    {"spectral", NULL, TOLERANCE, {{0.35, 0.35}, 0, false, true, true}},
    {"half_spectral", NULL, TOLERANCE, {{0.3, 0.6}, 2, true, true, true}},
    /* Roughnesses for which Mitsuba's series is long enough, and others. */
    {"hair_wide", HAIR("0.75", "0.5", SIGMA), TOLERANCE, {{0}, 0, 0, 0, 0}},
    {"hair_wide_spectral",
     HAIR("0.7", "0.6", "<spectrum name='sigma_a' value='400:.2,500:.5,700:.1'/>"),
     TOLERANCE,
     {{0}, 0, 0, 0, 0}},
    {"hair_tilted",
     HAIR("0.8", "0.7",
          SIGMA
          "<float name='scale_tilt' value='9'/><float name='int_ior' value='1.33'/>"),
     TOLERANCE,
     {{0}, 0, 0, 0, 0}},
    {"hair_wide_pigments",
     HAIR("0.75", "0.5",
          "<float name='eumelanin' value='.3'/><float name='pheomelanin' value='.5'/>"),
     TOLERANCE,
     {{0}, 0, 0, 0, 0}},
    {"hair", "<bsdf type='hair'/>", TOLERANCE_HAIR, {{0}, 0, 0, 0, 0}},
    {"hair_smooth", HAIR("0.15", "0.2", SIGMA), TOLERANCE_HAIR, {{0}, 0, 0, 0, 0}}};

static imp_context *ctx;

static void scene_text(const struct peer_case *c, const char *file, char *xml, size_t n)
{
    char measured[200];
    snprintf(measured, sizeof measured,
             "<bsdf type='measured'><string name='filename' value='%s'/></bsdf>", file);
    snprintf(xml, n, "<scene version='3.0.0'><shape type='sphere'>%s</shape></scene>\n",
             c->bsdf ? c->bsdf : measured);
}

static imp_scene *scene_of(const struct peer_case *c, enum imp_color_mode mode)
{
    char file[96], xml[800];
    snprintf(file, sizeof file, "drawn_values_%d.bsdf", (int)getpid());
    if (!c->bsdf && !rgl_write(file, &c->model)) exit(99);
    scene_text(c, file, xml, sizeof xml);
    imp_scene *s = test_scene_text(ctx, xml, mode);
    remove(file);
    return s;
}

static int scenes_write(const char *folder)
{
    for (size_t k = 0; k < imp_count(cases); k++) {
        char path[300], file[80], xml[800];
        const struct peer_case *c = &cases[k];
        snprintf(file, sizeof file, "%s.bsdf", c->name);
        snprintf(path, sizeof path, "%s/%s", folder, file);
        if (!c->bsdf && !rgl_write(path, &c->model)) return 1;
        snprintf(path, sizeof path, "%s/%s.xml", folder, c->name);
        scene_text(c, file, xml, sizeof xml);
        FILE *f = fopen(path, "w");
        if (!f || fputs(xml, f) < 0 || fclose(f) != 0) return 1;
    }
    return 0;
}

struct tally {
    double value, density, draw, planted;
    int n, lit;
};

static void most(double *x, double y)
{
    if (!(y <= *x)) *x = isnan(y) ? INFINITY : y;
}
static double apart(double a, double b) { return fabs(a - b) / (fabs(b) + 1e-3); }

/* `value` WO WI F[lanes] P, `draw` WO U[3] WI; at wavelengths 450, 500, 550, 600. */
static void row_check(const struct peer_case *k, const struct imp_bsdf *b, bool spectral,
                      const char *line, struct tally *t)
{
    double v[12];
    imp_spec in[IMP_INPUTS_MAX], f;
    const struct imp_carried carried = {4, {450, 500, 550, 600}};
    const struct imp_texcoord at = {.carried = spectral ? &carried : NULL};
    const int lanes = spectral ? 4 : 3;
    /* The cosine's, which Mitsuba's tables are not mixed with. */
    const double share = k->bsdf ? 0 : IMP_MEASURED_SHARE;
    const bool draw = strncmp(line, "draw", 4) == 0;
    const char *p = strchr(line, ' ');
    int n = 0;
    for (char *end; n < 12 && p; n++, p = end) {
        v[n] = strtod(p, &end);
        if (end == p) break;
    }
    imp__inputs_eval(b->input, b->n_in, &at, in);
    struct imp_dirs d = {imp__normalize(imp__v3(v[0], v[1], v[2])), {0}, IMP_SMOOTH, 0};
    if (draw && n == 9) {
        const double u[3] = {share > 0 ? 0.99 : v[3], v[4], v[5]};
        const bool drawn = b->ops->sample(b, in, u, &d);
        const imp_v3 wi = imp__v3(v[6], v[7], v[8]);
        most(&t->draw, drawn ? imp__length(d.wi - wi) : wi[2] > 1e-3);
        t->n++;
    } else if (!draw && n == 7 + lanes) {
        d.wi = imp__normalize(imp__v3(v[3], v[4], v[5]));
        b->ops->eval(b, in, &d, &f);
        const double all = b->ops->pdf(b, in, &d);
        for (int c = 0; c < lanes; c++) {
            most(&t->value, apart(f[c], v[6 + c]));
            most(&t->planted, apart((1 + 10 * k->tolerance) * f[c], v[6 + c]));
        }
        const double own = (all - share * imp__lambert(&d)) / (1 - share);
        /* Lobes are chosen by other weights of the wavelengths. */
        if (share > 0 || !spectral) most(&t->density, apart(own, v[6 + lanes]));
        t->n++;
        t->lit += v[6] > 0;
    }
}

static void report(const struct peer_case *k, const struct tally *t, imp_scene *scene)
{
    if (!scene) return;
    const bool other = k->bsdf && strstr(k->name, "spectral");
    tap_ok(t->value < k->tolerance && t->density < k->tolerance &&
               (other || t->draw < k->tolerance) && t->lit > 20 && t->n > 60,
           "%s # values %.1e, densities %.1e, draws %.1e off, of %d rows", k->name,
           t->value, t->density, t->draw, t->n);
    tap_ok(t->planted > k->tolerance, "ten tolerances more are caught # %.1e",
           t->planted);
    imp_scene_destroy(scene);
}

/* Colours of a file that has spectra alone, and wavelengths of one that has rgb alone. */
static void other_modes(void)
{
    static const enum imp_color_mode modes[] = {IMP_RGB, IMP_MONO, IMP_SPECTRAL, IMP_RGB};
    const struct imp_dirs d = {imp__normalize(imp__v3(0.3, 0.2, 0.8)),
                               imp__normalize(imp__v3(-0.4, 0.1, 0.7)), IMP_SMOOTH,
                               false};
    imp_spec in[IMP_INPUTS_MAX], f[4];
    for (int k = 0; k < 4; k++) {
        const struct imp_carried carried = {4, {450, 500, 550, 600}};
        const struct imp_texcoord at = {.carried = k == 2 ? &carried : NULL};
        imp_scene *s = scene_of(&cases[k < 2 ? 5 : 0], modes[k]);
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
    if (argc == 3 && strcmp(argv[1], "--write") == 0) return scenes_write(argv[2]);
    ctx = test_context(1);
    FILE *f = fopen(IMP_SCENES "/../tests/render/peer/drawn.txt", "r");
    if (!f) return 99;
    imp_scene *scene = NULL;
    struct tally t = {0};
    size_t k = 0, seen = 0;
    bool spectral = false;
    while (fgets(line, sizeof line, f)) {
        if (sscanf(line, "case %63s", name) == 1) {
            report(&cases[k], &t, scene);
            t = (struct tally){0};
            for (k = 0; k < imp_count(cases) && strcmp(cases[k].name, name) != 0;) k++;
            if (k == imp_count(cases)) return 99;
            spectral = strstr(name, "spectral") != NULL;
            scene = scene_of(&cases[k], spectral ? IMP_SPECTRAL : IMP_RGB);
            seen++;
        } else if (line[0] != '#' && scene) {
            row_check(&cases[k], scene->bsdfs[0], spectral, line, &t);
        }
    }
    report(&cases[k], &t, scene);
    tap_ok(seen == imp_count(cases), "%zu of %zu cases", seen, imp_count(cases));
    fclose(f);
    other_modes();
    imp_context_destroy(ctx);
    return tap_done();
}
