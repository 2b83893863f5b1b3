/* SPDX-License-Identifier: Apache-2.0
 *
 * Making materials: presets, defaults, and what is refused with which words. */
#include "imp_kinds.h"
#include "imp_tap.h"
#include "kind/bsdf/presets.h"

static struct kind_factory f;

static const struct imp_bsdf_ops *find(const char *name)
{
    for (int k = 0; imp__bsdf_kinds[k]; k++)
        if (strcmp(imp__bsdf_kinds[k]->name, name) == 0) return imp__bsdf_kinds[k];
    return NULL;
}

static void refused(const char *kind, const char *a, const char *b, const char *words)
{
    const char *props[2] = {a, b};
    struct imp_bsdf out;
    const bool made = kind_make(&f, find(kind), props, 2, NULL, 0, &out);
    tap_ok(!made && strstr(imp_last_error(f.ctx), words), "%s %s %s # %s", kind,
           a ? a : "", b ? b : "", made ? "made" : imp_last_error(f.ctx));
}
static void made(const char *kind, const char *a, const char *b)
{
    const char *props[2] = {a, b};
    struct imp_bsdf out;
    tap_ok(kind_make(&f, find(kind), props, 2, NULL, 0, &out), "%s %s %s # %s", kind, a,
           b ? b : "", imp_last_error(f.ctx));
}

static struct imp_node *prepared(const char *kind, const char *name,
                                 enum imp_prop_type type, double number, const char *text)
{
    struct imp_node *n =
        imp__node_create(&f.arena, "bsdf", kind, NULL, NULL, (struct imp_loc){0});
    if (name) {
        struct imp_prop *p = imp__node_add(&f.arena, n, name, type, (struct imp_loc){0});
        p->number[0] = number;
        p->string = text;
    }
    const struct imp_build b = {.ctx = f.ctx, .node = n, .arena = &f.arena};
    return find(kind)->prepare(&b) == IMP_OK ? n : NULL;
}

static void registry(void)
{
    bool whole = true, distinct = true;
    for (int k = 0; imp__bsdf_kinds[k]; k++) {
        const struct imp_bsdf_ops *o = imp__bsdf_kinds[k];
        whole &= o->size == sizeof *o && o->name && o->inputs && o->sample && o->eval &&
                 o->pdf && o->eval_d && !o->emit == !o->emit_d &&
                 o->max_children >= o->min_children && o->max_children <= 2;
        for (int j = 0; j < k; j++)
            distinct &= strcmp(o->name, imp__bsdf_kinds[j]->name) != 0;
    }
    tap_ok(whole && distinct, "every kind is whole and has a name of its own");
}

/* The attached derivative lacks a boundary term where the weight of a lobe's draws jumps
 * at the horizon: not where V takes it to 0, and not if all draws are cosine. */
static void stam_flags(void)
{
    static const char *const variants[] = {"reciprocal", "microfacet", "paper"};
    static const char *const samplings[] = {"mixture", "cosine", "phong"};
    bool right = true;
    for (int k = 0; k < 9; k++) {
        char variant[32], sampling[32];
        const char *props[2] = {variant, sampling};
        struct imp_bsdf b;
        snprintf(variant, sizeof variant, "variant=%s", variants[k / 3]);
        snprintf(sampling, sizeof sampling, "sampling=%s", samplings[k % 3]);
        right &= kind_make(&f, find("stam_m2"), props, 2, NULL, 0, &b) &&
                 !!(b.flags & IMP_BSDF_JUMP) == (k / 3 != 0 && k % 3 != 1);
    }
    tap_ok(right, "stam_m2 says where its weight jumps");

    const char *rare[] = {"absorb=0.2"}, *often[] = {"absorb=0.6"};
    struct imp_bsdf child[2], b;
    const bool ok = kind_make(&f, find("stam_m3"), often, 1, NULL, 0, &child[0]) &&
                    kind_make(&f, find("stam_m3"), rare, 1, NULL, 0, &child[1]) &&
                    kind_make(&f, find("twosided"), NULL, 0, child, 2, &b);
    tap_ok(ok && b.absorb == 0.6, "twosided absorbs as its darker side # %g", b.absorb);
}

/* What the aov shows: the reflectance; else pi f along the normal, where the mirror lobe
 * of phong is at its highest, (n + 2)/(2 pi); nothing of delta lobes. */
static void albedos(void)
{
    const imp_v3 up = imp__v3(0, 0, 1), down = imp__v3(0, 0, -1);
    struct imp_bsdf child[2], b;
    imp_spec in[4] = {
        {0.1, 0.2, 0.3, 0}, {0.4, 0.5, 0.6, 0}, imp__spec(8), {0.7, 0.8, 0.9, 0}};
    imp_spec a;
    bool ok = kind_make(&f, find("phong"), NULL, 0, NULL, 0, &child[0]) &&
              kind_make(&f, find("diffuse"), NULL, 0, NULL, 0, &child[1]) &&
              kind_make(&f, find("twosided"), NULL, 0, child, 2, &b);
    imp__bsdf_albedo(&b, in, &up, &a);
    tap_near(a[1], 0.2 + 0.5 * 5, 1e-14, 0, "albedo of phong");
    imp__bsdf_albedo(&b, in, &down, &a);
    tap_ok(ok && a[1] == 0.8, "albedo of the back # %g", a[1]);
    ok = kind_make(&f, find("conductor"), NULL, 0, NULL, 0, &b);
    imp__bsdf_albedo(&b, in, &up, &a);
    tap_ok(ok && a[0] == 0, "a mirror has none # %g", a[0]);
}

int main(void)
{
    if (!kinds_open(&f)) return 1;
    registry();
    made("dielectric", "int_ior=Water ICE", "ext_ior=1");
    refused("dielectric", "int_ior=-1.5", NULL, "int_ior = -1.5 is outside (0, inf]");
    refused("dielectric", "ext_ior=0", NULL, "ext_ior = 0 is outside (0, inf]");
    refused("dielectric", "int_ior=kryptonite", NULL, "known are vacuum, helium");
    refused("dielectric", "eta=1.5", NULL, "int_ior");
    refused("dielectric", "int_ior=true", NULL, "must be a");
    made("conductor", "material=none", NULL);
    made("conductor", "material=TiO2_palik", NULL);
    refused("conductor", "material=Ag_palik", NULL, "unknown material");
    refused("conductor", "material=Ag", "eta=1", "excludes");
    refused("roughconductor", "alpha=0.1", "alpha_u=0.1", "either 'alpha'");
    refused("roughconductor", "alpha_v=0.1", NULL, "either 'alpha'");
    made("roughconductor", "distribution=GGX", NULL);
    refused("roughconductor", "distribution=phong", NULL, "beckmann");
    refused("roughconductor", "sample_visible=1", NULL, "boolean");
    refused("stam_m2", "variant=stam", NULL, "reciprocal");
    refused("stam_m2", "absorb=1", NULL, "outside [0, 1)");
    refused("stam_m3", "absorb=-0.1", NULL, "outside [0, 1)");
    refused("stam_m3", "absorb=nan", NULL, "not finite");

    struct imp_node *n = prepared("conductor", "material", IMP_PROP_STRING, 0, "Cu");
    const struct imp_prop *eta = n ? imp__node_prop(n, "eta") : NULL;
    const struct imp_prop *k = n ? imp__node_prop(n, "k") : NULL;
    tap_ok(eta && k && eta->type == IMP_PROP_RGB && eta->number[1] == 0.92375 &&
               k->number[2] == 2.1421,
           "copper becomes numbers");
    n = prepared("dielectric", "int_ior", IMP_PROP_STRING, 0, "polypropylene");
    tap_ok(n && fabs(imp__node_prop(n, "eta")->number[0] - 1.489587) < 1e-6,
           "polypropylene in air");
    n = prepared("dielectric", "int_ior", IMP_PROP_STRING, 0, "water");
    tap_ok(n && fabs(imp__node_prop(n, "eta")->number[0] - 1.332631) < 1e-6,
           "water in air");
    n = prepared("roughconductor", NULL, IMP_PROP_FLOAT, 0, NULL);
    tap_ok(n && imp__node_prop(n, "alpha") &&
               imp__node_prop(n, "alpha")->number[0] == 0.1,
           "a roughness that is not given is a parameter too");
    n = prepared("roughconductor", "alpha", IMP_PROP_FLOAT, 0, NULL);
    tap_ok(n && imp__node_prop(n, "alpha")->number[0] == 1e-4,
           "roughness 0 is the smallest");

    stam_flags();
    albedos();
    struct imp_bsdf glass, out;
    kind_make(&f, find("dielectric"), NULL, 0, NULL, 0, &glass);
    tap_ok(!kind_make(&f, find("twosided"), NULL, 0, &glass, 1, &out) &&
               strstr(imp_last_error(f.ctx), "allow_transmission"),
           "twosided glass # %s", imp_last_error(f.ctx));
    /* Each blend doubles the lobes of glass: 2, 4, ... 128, 256. */
    struct imp_bsdf nest[8][2];
    int deep = 0;
    nest[0][0] = nest[0][1] = glass;
    for (; deep < 7; deep++) {
        if (!kind_make(&f, find("blendbsdf"), NULL, 0, nest[deep], 2, &nest[deep + 1][0]))
            break;
        nest[deep + 1][1] = nest[deep + 1][0];
    }
    tap_ok(deep == 6 && strstr(imp_last_error(f.ctx), "too deeply"),
           "lobes have an end # %s", imp_last_error(f.ctx));
    kinds_close(&f);
    return tap_done();
}
