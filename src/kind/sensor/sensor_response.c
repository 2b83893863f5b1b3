/* SPDX-License-Identifier: Apache-2.0
 *
 * Response curves of a specfilm and the factor `srf`, read from a film's properties. */
#include "sensor_response.h"
#include "base/compiler.h"
#include "color/cie.h"
#include "color/convert.h"
#include "sensor_film.h"
#include <string.h>

static enum imp_status curve_check(const struct imp_build *b, const char *name,
                                   const struct imp_spectrum *s)
{
    double total = 0;
    for (size_t k = 0; s->form == IMP_SPECTRUM_POINTS && k < s->n; k++)
        if (s->value[k] < 0)
            return imp_build_error(
                b, name, IMP_E_SCENE,
                "response '%s' is %g at %g nm: it cannot be negative", name, s->value[k],
                s->per_nm > 0 ? s->nm[0] + (double)k / s->per_nm : s->nm[k]);
    for (double nm = imp_max(s->lo, 1.0); nm <= imp_min(s->hi, 1e5); nm += 1) {
        const double v = imp__spectrum_value(s, nm);
        if (v < 0)
            return imp_build_error(b, name, IMP_E_SCENE,
                                   "response '%s' is %g at %g nm: it cannot be negative",
                                   name, v, nm);
        total += v;
    }
    if (!(total > 0))
        return imp_build_error(b, name, IMP_E_SCENE,
                               "response '%s' sees nothing: it is 0 everywhere", name);
    return IMP_OK;
}

/* A number is the same at all wavelengths from 360 to 830 nm. */
static enum imp_status curve_make(const struct imp_build *b, const char *name,
                                  const struct imp__color *color,
                                  struct imp_spectrum *out)
{
    if (color->spectrum) {
        *out = *color->spectrum;
    } else {
        struct imp_spectrum *s = imp__spectrum_make(b->arena, IMP_SPECTRUM_NUMBER, 1,
                                                    NULL, &(double){color->value[0]});
        if (!s) return imp__error(b->ctx, IMP_E_NOMEM, "out of memory");
        *out = *s;
    }
    if (!isfinite(out->hi)) {
        out->lo = IMP_CIE_FIRST_NM;
        out->hi = IMP_CIE_LAST_NM;
    }
    return curve_check(b, name, out);
}

static struct imp__color_ask ask_of(const struct imp_build *b)
{
    return (struct imp__color_ask){
        .ctx = b->ctx, .arena = b->arena, .mode = b->mode, .role = IMP_UNBOUNDED};
}

/* ---- Response curves -------------------------------------------------------------- */

static enum imp_status response_add(const struct imp_build *b, const char *name,
                                    const struct imp__color *color,
                                    struct imp_spectrum *curve, const char **names,
                                    int *n)
{
    if (*n == IMP_RESPONSES_MAX)
        return imp_build_error(b, NULL, IMP_E_SCENE, "more than %d response curves",
                               IMP_RESPONSES_MAX);
    const enum imp_status st = curve_make(b, name, color, &curve[*n]);
    if (st != IMP_OK) return st;
    for (int k = 0; k < *n; k++)
        if (strcmp(names[k], name) == 0)
            return imp_build_error(b, name, IMP_E_SCENE, "two responses named '%s'",
                                   name);
    names[(*n)++] = name;
    return IMP_OK;
}

enum imp_status imp__responses_read(const struct imp_build *b, struct imp_film_desc *f)
{
    enum imp_status st = IMP_OK;
    const struct imp__color_ask ask = ask_of(b);
    struct imp_node *node = b->node;
    struct imp_spectrum *curve =
        imp__arena_array(b->arena, IMP_RESPONSES_MAX, sizeof *curve);
    const char **names = imp__arena_array(b->arena, IMP_RESPONSES_MAX, sizeof *names);
    const char *bins;
    int n = 0;
    if (!imp__is_spectral(b->mode))
        IMP_TRY(imp_build_error(b, NULL, IMP_E_UNSUPPORTED,
                                "specfilm exists in spectral modes only "
                                "(-m spectral, -m single)"));
    if (!curve || !names) IMP_TRY(imp__error(b->ctx, IMP_E_NOMEM, "out of memory"));
    IMP_TRY(imp_build_string(b, "bins", NULL, &bins));
    for (size_t i = 0; i < node->n_props; i++) {
        struct imp_prop *p = &node->props[i];
        struct imp__color color;
        if (p->type != IMP_PROP_SPECTRUM && p->type != IMP_PROP_UNIFORM) continue;
        p->used = true;
        IMP_TRY(imp__color_convert(&ask, node, p, &color));
        IMP_TRY(response_add(b, p->name, &color, curve, names, &n));
    }
    for (size_t i = 0; i < node->n_children; i++) {
        struct imp_child *c = &node->children[i];
        struct imp__color color;
        if (!c->node || !imp__color_is_object(c->node)) continue;
        c->used = true;
        if (!c->name)
            IMP_TRY(imp__node_error(b->ctx, c->node, IMP_E_SCENE,
                                    "a response curve needs a name"));
        IMP_TRY(imp__color_object(&ask, c->node, &color));
        IMP_TRY(response_add(b, c->name, &color, curve, names, &n));
    }
    if (bins && n > 0)
        IMP_TRY(imp_build_error(b, "bins", IMP_E_SCENE,
                                "has response curves and bins: one of them"));
    if (bins) {
        st = imp__film_bins_build(b, bins, f);
        goto out;
    }
    if (n == 0)
        IMP_TRY(imp_build_error(b, NULL, IMP_E_SCENE,
                                "has no response curve: <spectrum name=...> gives one, "
                                "and bins some"));
    f->n_responses = n;
    f->response = curve;
    f->response_name = names;
out:
    return st;
}

/* ---- srf --------------------------------------------------------------------------- */

enum imp_status imp__srf_read(const struct imp_build *b, struct imp_film_desc *f)
{
    enum imp_status st = IMP_OK;
    const struct imp__color_ask ask = ask_of(b);
    struct imp_node *node = b->node;
    struct imp_prop *prop = imp__node_prop(node, "srf");
    struct imp_child *child = NULL;
    struct imp__color color;
    for (size_t i = 0; i < node->n_children; i++) {
        struct imp_child *c = &node->children[i];
        if (c->name && strcmp(c->name, "srf") == 0 && c->node &&
            imp__color_is_object(c->node))
            child = c;
    }
    if (!prop && !child) return IMP_OK;
    if (!imp__is_spectral(b->mode))
        IMP_TRY(imp_build_error(b, "srf", IMP_E_UNSUPPORTED,
                                "srf exists in spectral modes only (-m spectral, "
                                "-m single)"));
    if (f->n_responses > 0)
        IMP_TRY(imp_build_error(b, "srf", IMP_E_SCENE,
                                "srf and the response curves of a specfilm exclude each "
                                "other"));
    if (child) {
        child->used = true;
        IMP_TRY(imp__color_object(&ask, child->node, &color));
    } else {
        prop->used = true;
        IMP_TRY(imp__color_convert(&ask, node, prop, &color));
    }
    struct imp_spectrum *curve = imp__arena_array(b->arena, 1, sizeof *curve);
    if (!curve) IMP_TRY(imp__error(b->ctx, IMP_E_NOMEM, "out of memory"));
    IMP_TRY(curve_make(b, "srf", &color, curve));
    if (fmax(curve->lo, IMP_CIE_FIRST_NM) >= fmin(curve->hi, IMP_CIE_LAST_NM))
        IMP_TRY(imp_build_error(b, "srf", IMP_E_SCENE,
                                "the film sees nothing: srf is 0 from %g to %g nm",
                                IMP_CIE_FIRST_NM, IMP_CIE_LAST_NM));
    f->srf = curve;
out:
    return st;
}
