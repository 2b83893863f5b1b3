/* SPDX-License-Identifier: Apache-2.0
 *
 * Spectra and response curves in scenes of a spectral mode. The input is two texts, split
 * at the first byte 0: one stands for the values of colours of every kind, the other for
 * wavelengths, coefficients and names. What loads has finite values at all wavelengths, and
 * a picture. */
#include "base/text.h"
#include "scene/scene.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

/* As the value of an XML attribute. */
static void put(struct imp_text *t, const uint8_t *s, size_t n)
{
    for (size_t i = 0; i < n && i < 4096; i++) {
        const int c = s[i];
        if (c < 32 || c > 126 || strchr("<>&'\"$", c)) imp__put(t, " ");
        else imp__put(t, "%c", c);
    }
}

static void look(const struct imp_input *const *input, int n)
{
    for (int j = 0; j < n; j++) {
        const struct imp_spectrum *s = input[j]->spectrum;
        for (double nm = 360; s && nm <= 830; nm += 7)
            if (isnan(imp__spectrum_value(s, nm))) abort();
    }
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static const char *const before[] = {
        "<scene version='3.0.0'><integrator type='path'><integer name='max_depth' "
        "value='3'/></integrator><emitter type='constant'>",
        "</emitter><sensor type='perspective'><film type='specfilm'><integer "
        "name='width' "
        "value='2'/><integer name='height' value='2'/><spectrum name='a' value='",
        "'/><spectrum name='b' value='400:1,700:1'/><rfilter type='box'/></film></sensor>"
        "<shape type='sphere'>",
        "</shape></scene>"};
    static const char *const lights[] = {
        "<spectrum name='radiance' value='%'/>",
        "<spectrum type='irregular' name='radiance'><string name='values' value='%'/>"
        "<string name='wavelengths' value='@'/></spectrum>",
        "<spectrum type='illuminant' name='radiance'><string name='name' value='@'/>"
        "</spectrum>",
        "<spectrum type='blackbody' name='radiance'><float name='temperature' "
        "value='%'/></spectrum>"};
    static const char *const bodies[] = {
        "<bsdf type='diffuse'><spectrum name='reflectance' value='%'/></bsdf>",
        "<bsdf type='dielectric'><spectrum type='sellmeier' name='int_ior'><string "
        "name='B' value='%'/><string name='C' value='@'/></spectrum></bsdf>",
        "<bsdf type='dielectric'><string name='int_ior' value='@'/></bsdf>",
        "<bsdf type='roughconductor'><string name='material' value='@'/><spectrum "
        "name='alpha' value='%'/></bsdf>"};
    static imp_context *ctx;
    if (!ctx && imp_context_create(NULL, &ctx) != IMP_OK) abort();
    if (size < 2) return 0;
    const uint8_t *zero = memchr(data + 1, 0, size - 1);
    const size_t n = zero ? (size_t)(zero - data) - 1 : size - 1;
    const size_t m = zero ? size - n - 2 : 0;
    const char *part[2] = {lights[data[0] & 3], bodies[data[0] >> 2 & 3]};
    struct imp_text t = {.ctx = ctx};
    struct imp_load_options o = IMP_LOAD_OPTIONS_INIT;
    imp_scene *s;
    for (int k = 0; k < 4; k++) {
        imp__put(&t, "%s", before[k]);
        if (k == 1) put(&t, data + 1, n);
        for (const char *c = k == 0 ? part[0] : k == 2 ? part[1] : ""; *c; c++) {
            if (*c == '%') put(&t, data + 1, n);
            else if (*c == '@' && zero) put(&t, zero + 1, m);
            else imp__put(&t, "%c", *c);
        }
    }
    o.mode = data[0] & 16 ? IMP_SINGLE : IMP_SPECTRAL;
    if (!t.failed && imp_scene_load_string(ctx, (char *)t.bytes.data, t.bytes.size,
                                           "fuzz", &o, &s) == IMP_OK) {
        struct imp_run run = IMP_RUN_INIT;
        imp_film *f = NULL;
        run.spp = 2;
        run.drop_budget = 1;
        for (int b = 0; b < s->n_bsdfs; b++) look(s->bsdfs[b]->input, s->bsdfs[b]->n_in);
        for (int e = 0; e < s->n_emitters; e++)
            look(s->emitters[e]->input, s->emitters[e]->n_in);
        if (imp_render(s, &run, &f) == IMP_OK) imp_film_destroy(f);
        imp_scene_destroy(s);
    }
    imp__bytes_free(ctx, &t.bytes);
    return 0;
}
