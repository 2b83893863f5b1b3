/* SPDX-License-Identifier: Apache-2.0
 *
 * measured: a material of the RGL database (Dupuy and Jakob 2018; docs/scene-format.md
 * 5.2), front only,
 *
 *     f cos(theta_i) = scale S(x) D(m)/(4 sigma(wo)),     m the half-vector,
 *
 * D and sigma without the file's `jacobian` left out. Directions and half-vectors are
 * points of the unit square, u = (sqrt(theta/(pi/2)), phi/(2 pi) + 1/2), phi of m from
 * that of wo where the material is isotropic. x is where two warps come from that draw m:
 * from uniform numbers by the luminance of S to x, and from x by the density V of visible
 * normals to u(m). All tables but D and sigma depend on wo, between whose tabulated angles
 * they are interpolated linearly. Hence the density
 *
 *     p(wi) = L(x) V(u)/(2 pi^2 u_0 sin(theta_m) 4 wo.m),
 *
 * and a cosine's share, which covers what L or V leave out.
 *
 * S in rgb (red, green, blue are the colours of its planes, as of merl) or, where walks
 * carry wavelengths and the file has them, by wavelength; else its spectra under D65 are
 * the rgb. */
#include "measured.h"
#include "base/required.h"
#include "color/cie.h"
#include "color/rgb.h"
#include "kind/build.h"
#include "lambert.h"
#include "math/bilinear_warp.h"

enum { SCALE, RED, GREEN, BLUE, WAVELENGTH, N_INPUTS };
enum { THETA = IMP_MEASURED_THETA, PHI = IMP_MEASURED_PHI };

#define PLANE(key)                                                                       \
    {                                                                                    \
        .name = key, .role = IMP_REFLECTANCE,                                            \
        .flags = IMP_INPUT_FIXED | IMP_INPUT_LINEAR, .fallback = 1, .hi = 1, .unit = "1" \
    }
static const struct imp_input_desc inputs[] = {
    {.name = "scale",
     .role = IMP_REFLECTANCE,
     .flags = IMP_INPUT_SOFT,
     .fallback = 1,
     .hi = 1,
     .unit = "1"},
    PLANE("red"),
    PLANE("green"),
    PLANE("blue"),
    {.name = "wavelength", .flags = IMP_INPUT_WAVELENGTH, .unit = "nm"},
    {0}};

struct measured {
    const struct imp_measured_data *data;
    const float *rgb; /* the file's, or made from its spectra */
    struct imp__bilinear_warp normals, luminance;
    int fold; /* 2: the tables hold half a turn of wo, 4: a quarter */
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

static size_t directions(const struct imp_measured_data *t)
{
    return (size_t)t->n_phi * (size_t)t->n_theta;
}

/* The colours of the spectra, linear between the wavelengths and as at the ends beyond.
 * NULL: no memory. */
static float *colours_make(const struct imp_build *b, const struct imp_measured_data *t)
{
    const size_t square = (size_t)t->side * (size_t)t->side, n = (size_t)t->n_wave;
    const float *nm = t->table[IMP_MEASURED_WAVELENGTHS];
    float *rgb = imp_build_alloc(b, directions(t) * 3 * square, sizeof *rgb);
    double *weight = imp_build_alloc(b, n, 3 * sizeof *weight);
    double *at = imp_build_alloc(b, n + 2, sizeof *at);
    double *one = imp_build_alloc(b, n + 2, sizeof *one);
    if (!rgb || !weight || !at || !one) return NULL;
    at[0] = fmin(IMP_CIE_FIRST_NM, (double)nm[0]) - 1;
    at[n + 1] = fmax(IMP_CIE_LAST_NM, (double)nm[n - 1]) + 1;
    for (size_t k = 0; k < n; k++) at[k + 1] = (double)nm[k];
    for (size_t k = 0; k < n; k++) {
        for (size_t j = 0; j < n; j++) one[j + 1] = j == k;
        one[0] = one[1];
        one[n + 1] = one[n];
        imp__spectrum_to_rgb(n + 2, at, one, true, weight + 3 * k);
    }
    for (size_t d = 0; d < directions(t); d++) {
        const float *from = t->table[IMP_MEASURED_SPECTRA] + d * n * square;
        float *to = rgb + d * 3 * square;
        for (size_t i = 0; i < square; i++)
            for (size_t c = 0; c < 3; c++) {
                double sum = 0;
                for (size_t k = 0; k < n; k++)
                    sum += weight[3 * k + c] * (double)from[k * square + i];
                to[c * square + i] = (float)imp_max(sum, 0.0);
            }
    }
    return rgb;
}

static bool warp_make(const struct imp_build *b, struct imp__bilinear_warp *w, int rows,
                      int columns, const float *density, size_t grids)
{
    w->rows = rows;
    w->columns = columns;
    w->density = density;
    w->row = imp_build_alloc(b, grids * (size_t)rows, sizeof *w->row);
    w->column =
        imp_build_alloc(b, grids * (size_t)rows * (size_t)columns, sizeof *w->column);
    if (!w->row || !w->column) return false;
    imp__bilinear_warp_fill(w, grids);
    return true;
}

static enum imp_status build(const struct imp_build *b, void *self, struct imp_bsdf *bsdf)
{
    enum imp_status st = IMP_OK;
    struct measured *m = self;
    const char *filename;
    const struct imp_measured_data *t = m->data = b->node->measured;
    IMP_TRY(imp_build_string(b, "filename", NULL, &filename));
    if (!t) IMP_TRY(imp__node_missing(b->ctx, b->node, "filename"));
    const float *phi = t->table[PHI];
    if (t->n_phi > 2)
        m->fold = (int)lrint(IMP_2PI / (double)(phi[t->n_phi - 1] - phi[0]));
    m->rgb = t->rgb ? t->table[IMP_MEASURED_RGB] : colours_make(b, t);
    if (!m->rgb ||
        !warp_make(b, &m->normals, t->vndf[0], t->vndf[1], t->table[IMP_MEASURED_VNDF],
                   directions(t)) ||
        !warp_make(b, &m->luminance, t->side, t->side, t->table[IMP_MEASURED_LUMINANCE],
                   directions(t)))
        IMP_TRY(imp__error(b->ctx, IMP_E_NOMEM, "scene: no memory for a material"));
    bsdf->flags = IMP_BSDF_SMOOTH;
out:
    return st;
}

/* The interval of ascending x, and where in it; at the ends, the ends. */
static int interval(const float *x, int n, double at, double *t)
{
    int low = 0;
    *t = 0;
    if (n == 1) return 0;
    for (int high = n - 2; low < high;) {
        const int middle = (low + high + 1) / 2;
        if ((double)x[middle] <= at) low = middle;
        else high = middle - 1;
    }
    const double lo = (double)x[low], hi = (double)x[low + 1];
    *t = imp_min(imp_max((at - lo) / (hi - lo), 0.0), 1.0);
    return low;
}

static double theta_of(imp_v3 w) { return atan2(hypot(w[0], w[1]), w[2]); }
static double root_of(double theta) { return imp_min(sqrt(theta * (2 / IMP_PI)), 1.0); }

/* A direction wo in the tables' terms. */
struct sight {
    double turn[2]; /* of x and y: 1, or -1 where the fold mirrors */
    double phi;     /* of wo, folded */
    double u[2];    /* of wo */
    struct imp__bilinear_mix mix, normals, luminance;
};

/* False: nothing can be drawn for it. */
static bool sight_find(const struct measured *m, imp_v3 wo, struct sight *s)
{
    const struct imp_measured_data *t = m->data;
    const double theta = theta_of(wo);
    double a, c;
    s->turn[0] = s->turn[1] = 1;
    if (m->fold >= 2) {
        s->turn[1] = wo[1] < 0 ? 1 : -1;
        s->turn[0] = m->fold == 4 ? (wo[0] < 0 ? 1 : -1) : s->turn[1];
    }
    s->phi = atan2(s->turn[1] * wo[1], s->turn[0] * wo[0]);
    s->u[0] = root_of(theta);
    s->u[1] = s->phi / IMP_2PI + 0.5;
    const int i = interval(t->table[PHI], t->n_phi, s->phi, &a),
              j = interval(t->table[THETA], t->n_theta, theta, &c);
    s->mix.n = 0;
    for (int k = 0; k < 4; k++) {
        const double w = (k / 2 ? a : 1 - a) * (k % 2 ? c : 1 - c);
        if (w == 0) continue;
        s->mix.weight[s->mix.n] = w;
        s->mix.grid[s->mix.n++] =
            (size_t)(i + k / 2) * (size_t)t->n_theta + (size_t)(j + k % 2);
    }
    return imp__bilinear_warp_mix(&m->normals, &s->mix, &s->normals) &&
           imp__bilinear_warp_mix(&m->luminance, &s->mix, &s->luminance);
}

/* A pair of directions. */
struct pair {
    struct sight sight;
    double u[2], x[2];
    double area;    /* steradians of wi per unit of u's square */
    double normals; /* V(u) */
};

/* False: value and density are 0. */
static bool pair_find(const struct measured *m, const struct imp_dirs *d, struct pair *p)
{
    if (!imp__front(d) || !sight_find(m, d->wo, &p->sight)) return false;
    const struct sight *s = &p->sight;
    const imp_v3 h = imp__normalize(d->wo + d->wi);
    const double across = hypot(h[0], h[1]);
    const double phi =
        atan2(s->turn[1] * h[1], s->turn[0] * h[0]) - (m->data->n_phi <= 2 ? s->phi : 0);
    p->u[0] = root_of(atan2(across, h[2]));
    p->u[1] = phi / IMP_2PI + 0.5;
    p->u[1] -= floor(p->u[1]);
    p->area =
        imp_max(2 * IMP_PI * IMP_PI * p->u[0] * across, 1e-30) * 4 * imp__dot(d->wo, h);
    p->normals = imp__bilinear_warp_invert(&m->normals, &s->normals, p->u, p->x);
    return true;
}

/* What S is times. */
static double facets(const struct measured *m, const struct pair *p)
{
    static const struct imp__bilinear_mix one = {1, {0}, {1}};
    const struct imp_measured_data *t = m->data;
    if (!t->jacobian) return 1;
    const double sigma = imp__bilinear_value(t->table[IMP_MEASURED_SIGMA], t->sigma[0],
                                             t->sigma[1], &one, p->sight.u);
    const double ndf =
        imp__bilinear_value(t->table[IMP_MEASURED_NDF], t->ndf[0], t->ndf[1], &one, p->u);
    return sigma > 0 ? ndf / (4 * sigma) : 0;
}

/* Channel c of n of a table. */
static double channel(const struct measured *m, const struct pair *p, const float *table,
                      int n, int c)
{
    struct imp__bilinear_mix mix = p->sight.mix;
    for (int k = 0; k < mix.n; k++) mix.grid[k] = mix.grid[k] * (size_t)n + (size_t)c;
    return imp__bilinear_value(table, m->data->side, m->data->side, &mix, p->x);
}

static imp_spec reflectance(const struct measured *m, const struct pair *p,
                            const imp_spec *in)
{
    const struct imp_measured_data *t = m->data;
    const float *spectra = t->table[IMP_MEASURED_SPECTRA];
    imp_spec s = imp__spec(0);
    if (!spectra || !(in[WAVELENGTH][0] > 0)) {
        for (int c = 0; c < 3; c++) s += in[RED + c] * channel(m, p, m->rgb, 3, c);
        return s;
    }
    for (int l = 0; l < 4; l++) {
        double a;
        const int k = interval(t->table[IMP_MEASURED_WAVELENGTHS], t->n_wave,
                               in[WAVELENGTH][l], &a);
        s[l] = channel(m, p, spectra, t->n_wave, k);
        if (a > 0) s[l] += a * (channel(m, p, spectra, t->n_wave, k + 1) - s[l]);
    }
    return s;
}

static double pair_density(const struct measured *m, const struct pair *p,
                           const struct imp_dirs *d)
{
    double u[2];
    const double luminance =
        imp__bilinear_warp_invert(&m->luminance, &p->sight.luminance, p->x, u);
    return IMP_MEASURED_SHARE * imp__lambert(d) +
           (1 - IMP_MEASURED_SHARE) * luminance * p->normals / p->area;
}

/* Times cos(theta_i), at scale 1. */
static imp_spec measured(const struct imp_bsdf *b, const imp_spec *in,
                         const struct imp_dirs *d)
{
    const struct measured *m = b->self;
    struct pair p;
    if (!pair_find(m, d, &p)) return imp__spec(0);
    return reflectance(m, &p, in) * facets(m, &p);
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
    struct pair p;
    (void)in;
    return pair_find(b->self, d, &p) ? pair_density(b->self, &p, d) : 0;
}
static double pdf_eval(const struct imp_bsdf *b, const imp_spec *in,
                       const struct imp_dirs *d, imp_spec *f)
{
    const struct measured *m = b->self;
    struct pair p;
    if (!pair_find(m, d, &p)) return 0;
    const imp_spec value = reflectance(m, &p, in) * facets(m, &p);
    *f = in[SCALE] * value;
    return pair_density(m, &p, d);
}

static bool sample(const struct imp_bsdf *b, const imp_spec *in, const double u[3],
                   struct imp_dirs *d)
{
    const struct measured *m = b->self;
    struct sight s;
    double x[2], at[2];
    (void)in;
    if (!(d->wo[2] > 0) || !sight_find(m, d->wo, &s)) return false;
    if (u[0] < IMP_MEASURED_SHARE) return imp__lambert_sample(&u[1], d);
    imp__bilinear_warp_draw(&m->luminance, &s.luminance, (double[2]){u[2], u[1]}, x);
    imp__bilinear_warp_draw(&m->normals, &s.normals, x, at);
    const double theta = at[0] * at[0] * (IMP_PI / 2), across = sin(theta),
                 phi = (2 * at[1] - 1) * IMP_PI + (m->data->n_phi <= 2 ? s.phi : 0);
    const imp_v3 h =
        imp__v3(s.turn[0] * cos(phi) * across, s.turn[1] * sin(phi) * across, cos(theta));
    const double c = imp__dot(d->wo, h);
    if (!(c > 0)) return false;
    d->wi = imp__normalize(h * (2 * c) - d->wo);
    d->lobe = IMP_SMOOTH;
    return d->wi[2] > 0;
}

const struct imp_bsdf_ops imp__measured = {.size = sizeof(struct imp_bsdf_ops),
                                           .name = "measured",
                                           .object_size = sizeof(struct measured),
                                           .inputs = inputs,
                                           .prepare = prepare,
                                           .build = build,
                                           .sample = sample,
                                           .eval = eval,
                                           .pdf = pdf,
                                           .eval_d = eval_d,
                                           .pdf_eval = pdf_eval};
