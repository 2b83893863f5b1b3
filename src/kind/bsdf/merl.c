/* SPDX-License-Identifier: Apache-2.0
 *
 * merl: a measured material (Matusik et al. 2003),
 *
 *     f cos(theta_i) = scale (red rho_r + green rho_g + blue rho_b) cos(theta_i), front
 *
 * rho from a table (merl.h; docs/scene-format.md 5.2). red, green and blue are the colours of
 * its three planes: in rgb their own lanes, in mono their luminances, and by wavelength the
 * linear basis of colours (color/rgb_basis.h): what is grey stays grey, and nothing exceeds 1
 * that did not before.
 *
 * Directions are drawn by half-vectors, with the table's own lobe for the direction of
 * sight, and by the cosine: p = s cos/pi + (1 - s) p(h)/(4 wo.h). The cosine's share s
 * samples the Lambertian part of the lobe, and covers directions that the table, made of
 * some half-vectors of every cell, misses. */
#include "merl.h"
#include "base/required.h"
#include "kind/build.h"
#include "lambert.h"

enum { SCALE, RED, GREEN, BLUE, N_INPUTS };

#define PLANE(key)                                                                       \
    {                                                                                    \
        .name = key, .role = IMP_REFLECTANCE,                                            \
        .flags = IMP_INPUT_FIXED | IMP_INPUT_LINEAR, .fallback = 1, .hi = 1, .unit = "1" \
    }
static const struct imp_input_desc inputs[] = {{.name = "scale",
                                                .role = IMP_REFLECTANCE,
                                                .flags = IMP_INPUT_SOFT,
                                                .fallback = 1,
                                                .hi = 1,
                                                .unit = "1"},
                                               PLANE("red"),
                                               PLANE("green"),
                                               PLANE("blue"),
                                               {0}};

struct merl {
    const struct imp_merl_data *table;
    struct imp__merl_lobes lobes;
};

static enum imp_status prepare(const struct imp_build *b)
{
    static const char *const names[] = {"red", "green", "blue"};
    enum imp_status st = IMP_OK;
    for (int k = 0; k < 3; k++) {
        double colour[3] = {0};
        colour[k] = 1;
        if (!imp_build_has(b, names[k])) IMP_TRY(imp_build_set(b, names[k], 3, colour));
    }
out:
    return st;
}

static enum imp_status build(const struct imp_build *b, void *self, struct imp_bsdf *bsdf)
{
    enum imp_status st = IMP_OK;
    struct merl *m = self;
    const char *filename;
    IMP_TRY(imp_build_string(b, "filename", NULL, &filename));
    m->table = b->node->merl;
    if (!m->table) IMP_TRY(imp__node_missing(b->ctx, b->node, "filename"));
    const size_t rows = imp__merl_lobes_rows(m->table);
    m->lobes.row = imp_build_alloc(b, rows, sizeof(double));
    m->lobes.column = imp_build_alloc(b, rows * IMP_MERL_TURNS, sizeof(double));
    if (!m->lobes.row || !m->lobes.column)
        IMP_TRY(imp__error(b->ctx, IMP_E_NOMEM, "scene: no memory for a material"));
    imp__merl_lobes_fill(m->table, &m->lobes);
    bsdf->flags = IMP_BSDF_SMOOTH;
out:
    return st;
}

/* Times cos(theta_i), at scale 1. */
static imp_spec measured(const struct imp_bsdf *b, const imp_spec *in,
                         const struct imp_dirs *d)
{
    const struct merl *m = b->self;
    double rho[3];
    if (!imp__front(d)) return imp__spec(0);
    imp__merl_rho(m->table, d->wo, d->wi, rho);
    return (in[RED] * rho[0] + in[GREEN] * rho[1] + in[BLUE] * rho[2]) * d->wi[2];
}

static void eval(const struct imp_bsdf *b, const imp_spec *in, const struct imp_dirs *d,
                 imp_spec *f)
{
    *f = in[SCALE] * measured(b, in, d);
}
static void eval_d(const struct imp_bsdf *b, const imp_spec *in, const struct imp_dirs *d,
                   imp_spec *df)
{
    for (int j = 0; j < N_INPUTS; j++) df[j] = imp__spec(0);
    df[SCALE] = measured(b, in, d);
}

static double pdf(const struct imp_bsdf *b, const imp_spec *in, const struct imp_dirs *d)
{
    const struct merl *m = b->self;
    (void)in;
    if (!imp__front(d)) return 0;
    const imp_v3 h = imp__normalize(d->wo + d->wi);
    const double half = imp__merl_half_pdf(m->table, &m->lobes, d->wo, h);
    const double share = imp__merl_share(&m->lobes, d->wo);
    return share * imp__lambert(d) + (1 - share) * half / (4 * imp__dot(d->wo, h));
}
static bool sample(const struct imp_bsdf *b, const imp_spec *in, const double u[3],
                   struct imp_dirs *d)
{
    const struct merl *m = b->self;
    (void)in;
    if (!(d->wo[2] > 0)) return false;
    if (u[0] < imp__merl_share(&m->lobes, d->wo)) return imp__lambert_sample(&u[1], d);
    const imp_v3 h = imp__merl_half_draw(m->table, &m->lobes, d->wo, &u[1]);
    const double c = imp__dot(d->wo, h);
    if (!(c > 0)) return false;
    d->wi = imp__normalize(h * (2 * c) - d->wo);
    d->lobe = IMP_SMOOTH;
    return d->wi[2] > 0;
}

const struct imp_bsdf_ops imp__merl = {.size = sizeof(struct imp_bsdf_ops),
                                       .name = "merl",
                                       .object_size = sizeof(struct merl),
                                       .inputs = inputs,
                                       .prepare = prepare,
                                       .build = build,
                                       .sample = sample,
                                       .eval = eval,
                                       .pdf = pdf,
                                       .eval_d = eval_d};
