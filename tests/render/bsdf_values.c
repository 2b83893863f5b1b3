/* SPDX-License-Identifier: Apache-2.0
 *
 * Values of materials, direction by direction, against those that Mitsuba 3.9.1 gave for
 * the same file, kept in peer/bsdfs.txt by bench/peers/bsdf_values.py. Its numbers are
 * single precision. */
#include "imp_scene.h"
#include "imp_tap.h"
#include "scene/scene.h"
#include <math.h>

#define TOLERANCE 3e-4
/* The tables of its rough coats: means over 32 x 32 facets, 1e-3 off under grazing angles. */
#define TOLERANCE_COAT 2e-3
/* Its fit of the mean reflectance from inside is 5e-4 off, which is 1.2e-3 of the base. */
#define TOLERANCE_PLASTIC 1.5e-3

struct row {
    double uv[2];
    imp_v3 wo, wi;
    double f[3];
};

/* Coefficients of all delta lobes that send wi to wo. */
static void delta_eval(const struct imp_bsdf *b, const imp_spec *in, const struct row *r,
                       imp_spec *sum)
{
    bool seen[128] = {false};
    *sum = imp__spec(0);
    for (int k = 0; k < 200; k++) {
        struct imp_dirs d = {r->wo, {0}, IMP_SMOOTH, 0};
        const double u[3] = {(k + 0.5) / 200, 0.3, 0.6};
        imp_spec f;
        if (!b->ops->sample(b, in, u, &d) || d.lobe < 0 || seen[d.lobe]) continue;
        seen[d.lobe] = true;
        if (!(imp__dot(d.wi, r->wi) > 1 - 1e-5)) continue;
        b->ops->eval(b, in, &d, &f);
        *sum += f;
    }
}

struct tally {
    char name[64];
    int smooth, delta, lit;
    double worst;
};

static void row_check(const struct imp_bsdf *b, const struct imp_shape *shape,
                      const struct row *r, bool delta, double factor, struct tally *t)
{
    imp_spec in[IMP_INPUTS_MAX], f;
    const struct imp_texcoord at = {.uv = {r->uv[0], r->uv[1]}, .shape = shape};
    const struct imp_dirs d = {r->wo, r->wi, IMP_SMOOTH, 0};
    imp__inputs_eval(b->input, b->n_in, &at, in);
    if (delta) delta_eval(b, in, r, &f);
    else if (b->flags & IMP_BSDF_SMOOTH) b->ops->eval(b, in, &d, &f);
    else f = imp__spec(0);
    t->smooth += !delta;
    t->delta += delta;
    t->lit += r->f[0] > 0;
    for (int c = 0; c < 3; c++)
        t->worst = fmax(t->worst, fabs(factor * f[c] - r->f[c]) / (fabs(r->f[c]) + 1e-4));
}

static void report(const struct tally *t)
{
    const double limit = strncmp(t->name, "coat", 4) == 0      ? TOLERANCE_COAT
                         : strncmp(t->name, "plastic", 7) == 0 ? TOLERANCE_PLASTIC
                                                               : TOLERANCE;
    if (t->name[0])
        tap_ok(t->worst < limit && t->lit > 8,
               "%s # largest error %.1e, %d values, %d lit, %d of delta lobes", t->name,
               t->worst, t->smooth, t->lit, t->delta);
}

int main(void)
{
    char line[1024];
    struct tally t = {{0}, 0, 0, 0, 0}, planted = {{0}, 0, 0, 0, 0};
    const struct imp_shape *shape = NULL;
    imp_context *ctx = test_context(1);
    imp_scene *scene = test_scene(ctx, "../tests/render/peer/bsdfs.xml", IMP_RGB, NULL);
    FILE *f = fopen(IMP_SCENES "/../tests/render/peer/bsdfs.txt", "r");
    if (!f) return 99;
    while (fgets(line, sizeof line, f)) {
        struct row r = {.wo = {0}};
        char name[64], word[16];
        if (sscanf(line, "bsdf %63s", name) == 1) {
            report(&t);
            t = (struct tally){{0}, 0, 0, 0, 0};
            snprintf(t.name, sizeof t.name, "%s", name);
            shape = NULL;
            for (int i = 0; i < scene->n_shapes; i++)
                if (strcmp(scene->shapes[i]->name, name) == 0) shape = scene->shapes[i];
            if (!shape) tap_ok(0, "no shape '%s'", name);
            continue;
        }
        double v[11];
        if (!shape || sscanf(line, "%15s %lf %lf %lf %lf %lf %lf %lf %lf %lf %lf %lf",
                             word, &v[0], &v[1], &v[2], &v[3], &v[4], &v[5], &v[6], &v[7],
                             &v[8], &v[9], &v[10]) != 12)
            continue;
        for (int k = 0; k < 2; k++) r.uv[k] = v[k];
        r.wo = imp__normalize(imp__v3(v[2], v[3], v[4]));
        r.wi = imp__normalize(imp__v3(v[5], v[6], v[7]));
        for (int k = 0; k < 3; k++) r.f[k] = v[8 + k];
        const struct imp_bsdf *b = imp__shape_bsdf(scene, shape);
        row_check(b, shape, &r, word[0] == 'd', 1, &t);
        row_check(b, shape, &r, word[0] == 'd', 1.001, &planted);
    }
    report(&t);
    tap_ok(planted.worst > TOLERANCE, "0.1 %% more is caught # %.1e", planted.worst);
    fclose(f);
    imp_scene_destroy(scene);
    imp_context_destroy(ctx);
    return tap_done();
}
