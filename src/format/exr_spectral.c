/* SPDX-License-Identifier: Apache-2.0
 *
 * Names of spectral channels in a film and in a file (Fichet et al. 2021), and the RGB picture of a
 * spectral one. */
#include "exr_spectral.h"
#include "base/number.h"
#include "color/cie.h"
#include "color/rgb.h"
#include <math.h>
#include <stdio.h>
#include <string.h>

/* Characters before the number: "S0." or "T."; 0: another name. */
static size_t component(const char *name)
{
    if (name[0] == 'S' && name[1] >= '0' && name[1] <= '3' && name[2] == '.') return 3;
    return name[0] == 'T' && name[1] == '.' ? 2 : 0;
}

double imp__exr_wavelength(const char *name, bool *emissive)
{
    const size_t skip = component(name), n = strlen(name);
    const char *s = name + skip, *end = name + n - 2;
    double nm;
    if (emissive) *emissive = skip == 3;
    if (!skip || n < skip + 3 || strcmp(end, "nm") != 0 || *s < '0' || *s > '9') return 0;
    return imp__number(&s, end, &nm) && s == end && isfinite(nm) && nm > 0 ? nm : 0;
}

void imp__exr_name_to_file(const char *name, char text[IMP_EXR_NAME_ROOM])
{
    const char *own = strncmp(name, "se.", 3) == 0 ? name + 3 : name;
    const double nm = imp__exr_wavelength(own, NULL);
    const int skip = (int)(own - name + (ptrdiff_t)component(own));
    if (nm > 0 && nm < 1e9)
        snprintf(text, IMP_EXR_NAME_ROOM, "%.*s%.6fnm", skip, name, nm);
    else snprintf(text, IMP_EXR_NAME_ROOM, "%s", name);
    for (char *c = text + skip; nm > 0 && *c; c++) *c = *c == '.' ? ',' : *c;
}

void imp__exr_name_to_film(const char *name, char text[IMP_EXR_NAME_ROOM])
{
    const char *own = strncmp(name, "se.", 3) == 0 ? name + 3 : name;
    snprintf(text, IMP_EXR_NAME_ROOM, "%s", name);
    if (!component(own)) return;
    for (char *c = text; *c; c++) /* the comma of a number: between digits */
        if (*c == ',' && c[1] >= '0' && c[1] <= '9') *c = '.';
    const double nm = imp__exr_wavelength(text + (own - name), NULL);
    const int skip = (int)(own - name + (ptrdiff_t)component(own));
    if (nm > 0) snprintf(text, IMP_EXR_NAME_ROOM, "%.*s%.9gnm", skip, name, nm);
}

/* ---- Colour ------------------------------------------------------------------------- */

/* The channel whose wavelength is nearest; -1: none within reach. */
static int nearest(const imp_film *f, const double *nm, double at, double reach)
{
    int best = -1;
    for (int c = 0; c < f->channels; c++)
        if (nm[c] > 0 && (best < 0 || fabs(nm[c] - at) < fabs(nm[best] - at))) best = c;
    return best >= 0 && fabs(nm[best] - at) <= reach ? best : -1;
}

/* [channels][3]; false: the film has no spectral channels. nm: [channels], scratch. */
static bool weights(const imp_film *f, double *nm, double (*weight)[3])
{
    bool light = false;
    double lo = INFINITY, hi = 0;
    int n = 0;
    for (int c = 0; c < f->channels; c++)
        light = light || (strncmp(f->names[c], "S0.", 3) == 0 &&
                          imp__exr_wavelength(f->names[c], NULL) > 0);
    for (int c = 0; c < f->channels; c++) {
        const char *name = f->names[c];
        const bool used = light ? strncmp(name, "S0.", 3) == 0 : name[0] == 'T';
        nm[c] = used ? imp__exr_wavelength(name, NULL) : 0;
        if (!(nm[c] > 0)) continue;
        n++;
        lo = fmin(lo, nm[c]);
        hi = fmax(hi, nm[c]);
    }
    /* The first and the last reach as far out as channels are apart. */
    const double reach = n > 1 ? (hi - lo) / (n - 1) : INFINITY;
    for (double l = IMP_CIE_FIRST_NM + 0.5; n > 0 && l < IMP_CIE_LAST_NM; l += 1) {
        const int c = nearest(f, nm, l, l < lo || l > hi ? reach / 2 : INFINITY);
        const double d65 =
            light ? 1 : imp__cie_lookup(imp__cie_d65, l) / IMP_CIE_D65_SCALE;
        double xyz[3], rgb[3];
        if (c < 0) continue;
        for (int k = 0; k < 3; k++)
            xyz[k] = d65 * imp__cie_lookup(imp__cie_xyz[k], l) / IMP_CIE_Y_INTEGRAL;
        imp__xyz_to_rgb(xyz, rgb);
        for (int k = 0; k < 3; k++) weight[c][k] += rgb[k];
    }
    return n > 0;
}

enum imp_status imp__exr_spectral_rgb(const imp_film *f, imp_film **out)
{
    enum imp_status st = IMP_OK;
    const size_t channels = (size_t)f->channels;
    *out = NULL;
    if (imp__film_find(f, "R") >= 0) return IMP_OK;
    double *nm = imp__alloc(f->ctx, channels, sizeof *nm);
    double(*weight)[3] = imp__alloc(f->ctx, channels, sizeof *weight);
    imp_film *rgb = NULL;
    if (!nm || !weight)
        IMP_TRY(imp__error(f->ctx, IMP_E_NOMEM, "no memory for the colours of a film"));
    if (!weights(f, nm, weight)) goto out;
    IMP_TRY(imp__film_create(f->ctx, f->width, f->height, "R,G,B", false, &rgb));
    for (size_t i = 0; i < (size_t)f->width * (size_t)f->height; i++)
        for (int k = 0; k < 3; k++) {
            double sum = 0;
            for (size_t c = 0; c < channels; c++)
                if (weight[c][k] != 0)
                    sum += weight[c][k] * (double)f->mean[i * channels + c];
            rgb->mean[3 * i + (size_t)k] = (float)sum;
        }
    *out = rgb;
out:
    imp__release(f->ctx, nm);
    imp__release(f->ctx, weight);
    return st;
}
