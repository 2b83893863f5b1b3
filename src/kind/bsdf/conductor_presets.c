/* SPDX-License-Identifier: Apache-2.0
 *
 * Complex refractive indices of metals and other absorbers under rgb
 * (docs/scene-format.md A.3): measured spectra integrated against the observer, without
 * an illuminant. */
#include "color/color_tables.h"
#include "presets.h"
#include <string.h>

static const struct imp__conductor conductors[] = {
    {"Ag", {0.15528, 0.11673, 0.13839}, {4.8284, 3.1222, 2.1469}},
    {"Al", {1.6575, 0.8804, 0.52124}, {9.2238, 6.2695, 4.837}},
    {"AlAs", {3.6053, 3.2329, 2.2163}, {0.00067944, 0, 0.0075127}},
    {"AlSb", {0, 4.1394, 4.6693}, {0, 0.094009, 1.3006}},
    {"Au", {0.14304, 0.37531, 1.442}, {3.983, 2.3856, 1.6034}},
    {"Be", {4.185, 3.185, 2.7841}, {3.8355, 3.0101, 2.869}},
    {"Cr", {4.3697, 2.9165, 1.6549}, {5.2065, 4.2313, 3.7547}},
    {"CsI", {2.1449, 1.7023, 1.6624}, {0, 0, 0}},
    {"Cu", {0.20101, 0.92375, 1.1022}, {3.9133, 2.453, 2.1421}},
    {"Cu2O", {3.5518, 2.9499, 2.7519}, {0.11421, 0.1939, 0.60613}},
    {"CuO", {3.2475, 2.4478, 2.2102}, {0.52109, 0.57003, 0.72218}},
    {"Cu_palik", {0.21323, 0.91972, 1.1024}, {3.9219, 2.4573, 2.1366}},
    {"Hg", {2.3989, 1.44, 0.90957}, {6.3276, 4.3719, 3.4218}},
    {"HgTe", {4.779, 3.2312, 2.6599}, {1.6316, 1.5808, 1.7293}},
    {"Ir", {3.0863, 2.0822, 1.6179}, {5.5922, 4.0671, 3.2673}},
    {"K", {0.064043, 0.04641, 0.038185}, {2.1042, 1.3489, 0.91313}},
    {"Li", {0.26579, 0.19562, 0.22095}, {3.5402, 2.3111, 1.6686}},
    {"MgO", {2.0896, 1.6507, 1.5949}, {0, 0, 0}},
    {"Mo", {4.484, 3.5251, 2.7763}, {4.1114, 3.4208, 3.1506}},
    {"Na_palik", {0.060269, 0.056141, 0.061988}, {3.1793, 2.1125, 1.579}},
    {"Nb", {3.4201, 2.7901, 2.3956}, {3.4414, 2.7377, 2.5797}},
    {"Ni_palik", {2.3673, 1.6634, 1.4671}, {4.4988, 3.0502, 2.3454}},
    {"Rh", {2.5858, 1.8602, 1.5543}, {6.7823, 4.703, 3.9761}},
    {"Se", {4.0583, 2.8429, 2.8209}, {0.75405, 0.63844, 0.52181}},
    {"Se-e", {5.7228, 4.1657, 4.0813}, {0.87114, 1.1052, 1.5653}},
    {"SiC", {3.1723, 2.526, 2.4794}, {0, 0, 0.00001}},
    {"SnTe", {4.5242, 1.9816, 1.2816}, {0, 0, 0}},
    {"Ta", {2.0627, 2.3929, 2.6279}, {2.4084, 1.7415, 1.947}},
    {"Te", {7.3902, 4.4821, 2.6371}, {3.256, 3.5271, 3.2921}},
    {"Te-e", {7.5089, 4.2964, 2.37}, {5.5839, 4.9472, 3.9976}},
    {"ThF4", {1.8307, 1.4422, 1.3876}, {0, 0, 0}},
    {"TiC", {3.7005, 2.8374, 2.5823}, {3.2656, 2.3516, 2.1728}},
    {"TiN", {1.6484, 1.1505, 1.3798}, {3.3683, 1.9435, 1.1021}},
    {"TiO2", {3.4566, 2.8017, 2.9052}, {0.000105, 0, 0.00065}},
    {"TiO2-e", {3.1066, 2.5132, 2.5824}, {0, 0, 0.00018}},
    {"VC", {3.6576, 2.7527, 2.5327}, {3.0683, 2.1987, 1.9632}},
    {"VN", {2.8656, 2.1192, 1.9401}, {3.0322, 2.0561, 1.6163}},
    {"V_palik", {4.2776, 3.5129, 2.7611}, {3.4913, 2.8895, 3.1115}},
    {"W", {4.3708, 3.3002, 2.9984}, {3.5006, 2.6049, 2.2732}},
    {"a-C", {2.944, 2.2271, 1.9682}, {0.88746, 0.7993, 0.81529}},
    {"d-C", {2.7087, 2.3188, 2.2289}, {0, 0, 0}},
};

static const struct imp__conductor *conductor_exact(const char *name, size_t length)
{
    for (size_t i = 0; i < imp_count(conductors); i++)
        if (strlen(conductors[i].name) == length &&
            strncmp(conductors[i].name, name, length) == 0)
            return &conductors[i];
    return NULL;
}

/* NAME_palik names data of Palik's handbook; the table, or this list, marks where the two
 * sources differ or there is no such data. */
const struct imp__conductor *imp__conductor_find(const char *name)
{
    static const char *const other_source[] = {"Ag", "Al", "Au", "Cr", "W", "a-C"};
    const size_t n = strlen(name), suffix = strlen("_palik");
    const struct imp__conductor *c = conductor_exact(name, n);
    if (c || n <= suffix || strcmp(name + n - suffix, "_palik") != 0) return c;
    c = conductor_exact(name, n - suffix);
    for (size_t i = 0; c && i < imp_count(other_source); i++)
        if (strcmp(c->name, other_source[i]) == 0) return NULL;
    return c;
}

const struct imp__conductor *imp__conductor_at(size_t i)
{
    return i < imp_count(conductors) ? &conductors[i] : NULL;
}

static enum imp_status color_add(const struct imp_build *b, const char *name,
                                 struct imp_loc loc, const double rgb[3])
{
    struct imp_prop *p = imp__node_add(b->arena, b->node, name, IMP_PROP_RGB, loc);
    if (!p) return imp__error(b->ctx, IMP_E_NOMEM, "out of memory");
    for (int c = 0; c < 3; c++) p->number[c] = rgb[c];
    return IMP_OK;
}

static enum imp_status spectrum_add(const struct imp_build *b, const char *name,
                                    struct imp_loc loc, int n, const double *nm,
                                    const double *value)
{
    struct imp_prop *p = imp__node_add(b->arena, b->node, name, IMP_PROP_SPECTRUM, loc);
    double *list = imp__arena_take(b->arena, 2 * (size_t)n, sizeof *list);
    if (!p || !list) return imp__error(b->ctx, IMP_E_NOMEM, "out of memory");
    memcpy(list, nm, (size_t)n * sizeof *list);
    memcpy(list + n, value, (size_t)n * sizeof *list);
    p->list = list;
    p->n = (size_t)n;
    return IMP_OK;
}

enum imp_status imp__conductor_prepare(const struct imp_build *b)
{
    enum imp_status st = IMP_OK;
    const char *name;
    const struct imp_prop *p = imp__node_prop(b->node, "material");
    if (!p) return IMP_OK;
    const struct imp_loc loc = p->loc; /* adding properties may move p */

    IMP_TRY(imp_build_string(b, "material", "none", &name));
    if (imp_build_has(b, "eta") || imp_build_has(b, "k"))
        IMP_TRY(imp_build_error(b, "material", IMP_E_SCENE,
                                "'material' excludes 'eta' and 'k'"));
    if (strcmp(name, "none") == 0) return IMP_OK; /* the defaults: a perfect mirror */
    const struct imp__conductor *c = imp__conductor_find(name);
    if (!c)
        IMP_TRY(
            imp_build_error(b, "material", IMP_E_SCENE,
                            "unknown material '%s'; the manual lists them (Ag, Al, Au, "
                            "Cu, ...)",
                            name));
    if (b->mode == IMP_SPECTRAL || b->mode == IMP_SINGLE) {
        const struct imp__metal *m = imp__metal_find(name);
        if (!m)
            IMP_TRY(imp_build_error(b, "material", IMP_E_UNSUPPORTED,
                                    "'%s' has no table of wavelengths; in spectral modes "
                                    "there are Ag, Al, Au, Cr, Cu, W and a-C: give 'eta' "
                                    "and 'k' as spectra",
                                    name));
        IMP_TRY(spectrum_add(b, "eta", loc, m->n, m->nm, m->eta));
        IMP_TRY(spectrum_add(b, "k", loc, m->n, m->nm, m->k));
        goto out;
    }
    IMP_TRY(color_add(b, "eta", loc, c->eta));
    IMP_TRY(color_add(b, "k", loc, c->k));
out:
    return st;
}
