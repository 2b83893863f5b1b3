/* SPDX-License-Identifier: Apache-2.0
 *
 * Materials in the basis: R_km = int int f(wi, wo) H_k(wo) H_m(wi) dwo dwi, without
 * cosine. An isotropic f depends on phi_o - phi_i only, so R couples functions of the
 * same m (and cosine with cosine), and its blocks come from the Fourier coefficients of
 * f. */
#include "elements.h"
#include "math/quadrature.h"
#include <stdio.h>
#include <string.h>

enum { NZ = 24, NPHI = 48, NM = EL_ORDER_MAX + 1 };

static double phong(const struct imp__el_material *m, imp_v3 wo, imp_v3 wi, int c)
{
    const double t = wo[2] * wi[2] - wo[0] * wi[0] - wo[1] * wi[1];
    const double lobe = t > 0 ? (m->exponent + 2) / IMP_2PI * pow(t, m->exponent) : 0;
    return m->kd[c] * IMP_INV_PI + m->ks[c] * lobe;
}

/* f and, if df is given, its derivative by every input that has a parameter: df [n_d][3].
 */
static void eval(const struct imp__el_material *m, imp_v3 wo, imp_v3 wi, imp_spec *in,
                 imp_spec *din, double f[3], double (*df)[3])
{
    f[0] = f[1] = f[2] = 0;
    if (m->phong) {
        for (int c = 0; c < 3; c++) f[c] = phong(m, wo, wi, c);
        for (int c = 0; c < 3 && df; c++) {
            df[0][c] = IMP_INV_PI;
            df[1][c] = m->ks[c] > 0
                           ? (f[c] - m->kd[c] * IMP_INV_PI) / m->ks[c]
                           : phong(&(struct imp__el_material){.ks = {1, 1, 1},
                                                              .exponent = m->exponent},
                                   wo, wi, c);
        }
        return;
    }
    if (!m->bsdf || !(m->bsdf->flags & IMP_BSDF_SMOOTH)) return;
    if (m->flipped) wo[2] = -wo[2], wi[2] = -wi[2];
    const struct imp_dirs d = {wo, wi, IMP_SMOOTH, 0};
    const double inv = 1 / fabs(wi[2]); /* kinds include the cosine */
    imp_spec value;
    m->bsdf->ops->eval(m->bsdf, in, &d, &value);
    for (int c = 0; c < 3; c++) f[c] = value[c] * inv;
    if (!df || !m->n_d) return;
    m->bsdf->ops->eval_d(m->bsdf, in, &d, din);
    for (int j = 0, k = 0; j < m->bsdf->n_in; j++) {
        if (m->bsdf->input[j]->param < 0) continue;
        for (int c = 0; c < 3; c++) df[k][c] = din[j][c] * inv;
        k++;
    }
}

static void inputs_at(const struct imp__el_material *m, imp_spec in[IMP_INPUTS_MAX])
{
    const struct imp_texcoord at = {.uv = {0.5, 0.5}};
    if (m->bsdf) imp__inputs_eval(m->bsdf->input, m->bsdf->n_in, &at, in);
}

void imp__el_brdf(const struct imp__el_material *m, imp_v3 wo, imp_v3 wi, double f[3])
{
    imp_spec in[IMP_INPUTS_MAX];
    inputs_at(m, in);
    f[0] = f[1] = f[2] = 0;
    if (wo[2] > 0 && wi[2] > 0) eval(m, wo, wi, in, NULL, f, NULL);
}

/* ---- May it be projected? ------------------------------------------------------ */

static imp_v3 at_angles(double z, double phi)
{
    const double r = sqrt(1 - z * z);
    return imp__v3(r * cos(phi), r * sin(phi), z);
}

static bool is_isotropic(const struct imp__el_material *m, imp_spec *in)
{
    for (int k = 0; k < 24; k++) {
        const double zo = 0.15 + 0.03 * k, zi = 0.95 - 0.035 * k, phi = 0.7 * k;
        const imp_v3 wo = at_angles(zo, 0), wi = at_angles(zi, phi);
        double f[3], turned[3], mirrored[3];
        eval(m, wo, wi, in, NULL, f, NULL);
        eval(m, at_angles(zo, 1 + k), at_angles(zi, phi + 1 + k), in, NULL, turned, NULL);
        eval(m, wo, at_angles(zi, -phi), in, NULL, mirrored, NULL);
        for (int c = 0; c < 3; c++)
            if (fabs(f[c] - turned[c]) + fabs(f[c] - mirrored[c]) >
                1e-6 * fabs(f[c]) + 1e-12)
                return false;
    }
    return true;
}

static enum imp_status check(imp_context *ctx, const char *shape,
                             const struct imp__el_material *m, imp_spec *in)
{
    const struct imp_bsdf *b = m->bsdf;
    if (!b || m->phong) return IMP_OK;
    const char *name = b->name && *b->name ? b->name : b->ops->name;
    if (b->flags & (IMP_BSDF_DELTA | IMP_BSDF_TRANSMIT))
        return imp__error(
            ctx, IMP_E_UNSUPPORTED,
            "shape '%s': material '%s' (%s) cannot be projected: finite elements "
            "have no mirrors and no glass",
            shape, name, b->ops->name);
    for (int j = 0; j < b->n_in; j++)
        if (b->input[j]->texture)
            return imp__error(
                ctx, IMP_E_UNSUPPORTED,
                "shape '%s': material '%s' (%s) has a texture, which finite "
                "elements cannot project",
                shape, name, b->ops->name);
    inputs_at(m, in);
    if (!is_isotropic(m, in))
        return imp__error(ctx, IMP_E_UNSUPPORTED,
                          "shape '%s': material '%s' (%s) is not isotropic, which finite "
                          "elements cannot project",
                          shape, name, b->ops->name);
    return IMP_OK;
}

/* ---- Projection ---------------------------------------------------------------- */

struct table {
    double f[NZ][NZ][NM];
}; /* Fourier coefficients in phi, [zo][zi][m] */

static void blocks(const struct imp__el_basis *b, const struct table *t, const double *w,
                   double (*h)[EL_N_MAX], double *r)
{
    for (int m = 0; m <= b->order; m++) {
        const int n = b->size[m], first = b->start[m];
        for (int k = 0; k < n; k++)
            for (int j = 0; j < n; j++) {
                double sum = 0;
                for (int o = 0; o < NZ; o++)
                    for (int i = 0; i < NZ; i++)
                        sum += w[o] * w[i] * h[o][first + k] * h[i][first + j] *
                               t->f[o][i][m];
                r[k * n + j] = sum * (m ? IMP_PI : IMP_2PI);
            }
        for (int k = 0; k < n; k++) /* reciprocity, to the last bit */
            for (int j = 0; j < k; j++)
                r[k * n + j] = r[j * n + k] = (r[k * n + j] + r[j * n + k]) / 2;
        r += n * n;
    }
}

/* Relative L2 error of lobes with zo > cos 80 degrees, and the largest directional
 * albedo. */
static void quality(const struct imp__el_basis *b, const struct table *t, const double *z,
                    const double *w, double (*h)[EL_N_MAX], const double *norm,
                    struct imp__el_material *m)
{
    for (int o = 0; o < NZ; o++) {
        double albedo = 0, kept = 0;
        for (int i = 0; i < NZ; i++) albedo += w[i] * z[i] * t->f[o][i][0];
        m->albedo_max = fmax(m->albedo_max, albedo);
        for (int q = 0; q <= b->order; q++)
            for (int k = 0; k < b->size[q]; k++) {
                double sum = 0;
                for (int i = 0; i < NZ; i++)
                    sum += w[i] * h[i][b->start[q] + k] * t->f[o][i][q];
                kept += sum * sum;
            }
        if (z[o] > 0.1736 && norm[o] > 0)
            m->residual = fmax(m->residual, sqrt(fmax(0, 1 - kept / norm[o])));
    }
}

static enum imp_status derivatives_make(imp_context *ctx, struct imp_arena *a,
                                        const char *shape, struct imp__el_material *m,
                                        const imp_spec *in)
{
    const int n_in = m->phong ? 2 : m->bsdf ? m->bsdf->n_in : 0;
    m->n_d = 0;
    m->d = imp__arena_array(a, (size_t)n_in + 1, sizeof *m->d);
    if (!m->d) return imp__error(ctx, IMP_E_NOMEM, "out of memory for materials");
    for (int j = 0; j < n_in; j++) {
        struct imp__el_material_d *d = &m->d[m->n_d];
        if (!m->phong && m->bsdf->input[j]->param < 0) continue;
        *d = (struct imp__el_material_d){.param = -1, .count = 3};
        if (m->phong) {
            char name[256];
            snprintf(name, sizeof name, "%s.phong.%s", m->label ? m->label : shape,
                     j ? "ks" : "kd");
            d->name = imp__arena_strdup(a, name);
            if (!d->name)
                return imp__error(ctx, IMP_E_NOMEM, "out of memory for materials");
            memcpy(d->value, j ? m->ks : m->kd, sizeof d->value);
        } else {
            d->param = m->bsdf->input[j]->param;
            d->count = m->bsdf->input[j]->count;
            for (int c = 0; c < 3; c++) d->value[c] = in[j][c];
        }
        d->r = imp__arena_array(a, 3, sizeof *d->r);
        if (!d->r) return imp__error(ctx, IMP_E_NOMEM, "out of memory for materials");
        m->n_d++;
    }
    return IMP_OK;
}

/* Basis functions that a matrix needs: 0, 1 or all. */
static int size_of(const struct imp__el_basis *b, const double *r)
{
    int n = 0;
    for (int q = 0; q <= b->order; q++) n += b->size[q] * b->size[q];
    double rest = 0;
    for (int k = 1; k < n; k++) rest = fmax(rest, fabs(r[k]));
    return rest > 1e-11 * (fabs(r[0]) + 1e-3) ? b->n : r[0] != 0;
}

enum imp_status imp__el_project(imp_context *ctx, struct imp_arena *a,
                                const struct imp__el_basis *b, int ch, const char *shape,
                                struct imp__el_material *m)
{
    enum imp_status st = IMP_OK;
    struct table *t = NULL;
    imp_spec *in = NULL;
    double z[NZ], w[NZ], h[NZ][EL_N_MAX], cosine[NPHI][NM];
    IMP_TRY(check(ctx, shape, m, (imp_spec[IMP_INPUTS_MAX]){{0}}));
    in = imp__alloc(ctx, 2 * IMP_INPUTS_MAX, sizeof *in);
    if (!in) IMP_TRY(imp__error(ctx, IMP_E_NOMEM, "out of memory for materials"));
    inputs_at(m, in);
    IMP_TRY(derivatives_make(ctx, a, shape, m, in));
    const size_t n_tables = 3 * (1 + (size_t)m->n_d);
    t = imp__alloc(ctx, n_tables, sizeof *t);
    double(*df)[3] = imp__arena_array(a, (size_t)m->n_d + 1, sizeof *df);
    if (!t || !df) IMP_TRY(imp__error(ctx, IMP_E_NOMEM, "out of memory for materials"));

    imp__gauss_legendre(NZ, 0, 1, z, w);
    for (int i = 0; i < NZ; i++) imp__basis_eval(b, at_angles(z[i], 0), h[i]);
    for (int p = 0; p < NPHI; p++)
        for (int q = 0; q < NM; q++)
            cosine[p][q] = cos(IMP_2PI * p * q / NPHI) * IMP_2PI / NPHI;
    double norm[3][NZ] = {{0}};
    for (int o = 0; o < NZ; o++)
        for (int i = 0; i < NZ; i++)
            for (int p = 0; p < NPHI; p++) {
                double f[3];
                eval(m, at_angles(z[o], 0), at_angles(z[i], IMP_2PI * p / NPHI), in,
                     in + IMP_INPUTS_MAX, f, df);
                for (int c = 0; c < ch; c++) {
                    norm[c][o] += w[i] * f[c] * f[c] * IMP_2PI / NPHI;
                    for (int q = 0; q < NM; q++) {
                        t[c].f[o][i][q] += f[c] * cosine[p][q];
                        for (int k = 0; k < m->n_d; k++)
                            t[3 * (k + 1) + c].f[o][i][q] += df[k][c] * cosine[p][q];
                    }
                }
            }
    m->albedo_max = m->residual = 0;
    m->n = 0;
    for (int c = 0; c < ch; c++) {
        blocks(b, &t[c], w, h, m->r[c]);
        quality(b, &t[c], z, w, h, norm[c], m);
        m->albedo[c] = m->r[c][0] / 2;
        m->n = imp_max(m->n, size_of(b, m->r[c]));
        for (int k = 0; k < m->n_d; k++) {
            blocks(b, &t[3 * (k + 1) + c], w, h, m->d[k].r[c]);
            m->n = imp_max(m->n, size_of(b, m->d[k].r[c])); /* also of black ones */
        }
    }
    if (!isfinite(m->albedo_max) || !isfinite(m->residual))
        IMP_TRY(imp__error(ctx, IMP_E_NUMERIC, "shape '%s': its material is not finite",
                           shape));
    if (m->n == 1) m->residual = 0;
out:
    imp__release(ctx, in);
    imp__release(ctx, t);
    return st;
}

void imp__el_apply(const struct imp__el_basis *b, int n, const double *r, const double *x,
                   double *y)
{
    if (n == 1) { /* Lambert, and measuring patches: the first block's first number */
        y[0] = r[0] * x[0];
        return;
    }
    for (int m = 0; m <= b->order && n; m++) {
        const int size = b->size[m];
        for (int part = 0; part < (m ? 2 : 1); part++) {
            const double *u = x + b->start[m] + part * size;
            double *v = y + b->start[m] + part * size;
            for (int k = 0; k < size; k++) {
                double sum = 0;
                for (int j = 0; j < size; j++) sum += r[k * size + j] * u[j];
                v[k] = sum;
            }
        }
        r += size * size;
    }
}
