/* SPDX-License-Identifier: Apache-2.0
 *
 * The solver against closed forms and against itself: furnaces, the three-patch chain,
 * the adjoint identity, derivatives, threads, files, hostile scenes. */
#include "base/film.h"
#include "elements/elements.h"
#include "imp_scene.h"
#include "imp_tap.h"
#include "math/quadrature.h"
#include <unistd.h>

static struct imp_elements_options options(void)
{
    struct imp_elements_options o = IMP_ELEMENTS_OPTIONS_INIT;
    o.stop = -1;
    return o;
}

static imp_elements *solved(imp_scene *s, const struct imp_elements_options *o)
{
    imp_elements *e;
    test_must(s->ctx, imp_elements_create(s, o, &e));
    test_must(s->ctx, imp_elements_solve(e));
    return e;
}

static imp_scene *box(imp_context *ctx, double rho, double emission,
                      enum imp_color_mode mode)
{
    char xml[2048];
    snprintf(xml, sizeof xml,
             "<scene version='3.0.0'>"
             "<sensor type='perspective'><transform name='to_world'>"
             "<lookat origin='0.1,0.2,0.3' target='1,0.5,0.4' up='0,1,0'/></transform>"
             "<float name='fov' value='100'/><film type='hdrfilm'>"
             "<integer name='width' value='8'/><integer name='height' "
             "value='8'/></film></sensor>"
             "<shape type='cube' id='box'><boolean name='flip_normals' value='true'/>"
             "<transform name='to_world'><scale x='1' y='0.6' z='1.7'/></transform>"
             "<bsdf type='diffuse'><rgb name='reflectance' value='%g'/></bsdf>"
             "<emitter type='area'><rgb name='radiance' "
             "value='%g'/></emitter></shape></scene>",
             rho, emission);
    return test_scene_text(ctx, xml, mode);
}

/* Closed box: L = E/(1 - rho) at every level; after k sweeps rho^(k+1)/(1 - rho) is
 * missing. */
static void furnace(imp_context *ctx)
{
    imp_scene *s = box(ctx, 0.6, 1, IMP_MONO);
    for (int level = 0; level < 3; level++) {
        struct imp_elements_options o = options();
        o.max_level = level;
        o.eps_first = o.eps_last = 1e-12;
        o.no_importance = level == 2;
        if (level == 0)
            o.eps_first = 1e12, o.eps_last = 1e11; /* 0 is the default level */
        imp_elements *e = solved(s, &o);
        test_must(ctx, imp__el_settle(e, 8, true, 1e-14));
        double worst = 0;
        for (size_t k = 0; k < e->n_elements; k++)
            worst =
                fmax(worst,
                     fabs(imp__el_at(e, e->l, &e->elements[k])[0] / sqrt(IMP_2PI) - 1.5));
        tap_ok(worst < 2e-12 && e->n_elements == (level == 0   ? 6
                                                  : level == 1 ? 30
                                                               : 126),
               "furnace, level %d, %zu elements, %zu links # worst %.2e", level,
               e->n_elements, e->n_links, worst);
        tap_near(imp__el_measure(e, NULL), 2.5, 1e-12, 0, "what the eye sees");
        tap_near(imp__el_measure_adjoint(e), 2.5, 1e-12, 0, "from the lights' side");
        test_must(ctx, imp__el_sweep(e, 5, true, true));
        tap_near(2.5 - imp__el_measure(e, NULL), pow(0.6, 6) / 0.4, 1e-9, 0,
                 "after 5 sweeps the rest is rho^6/(1 - rho)");
        imp_elements_destroy(e);
    }
    /* Unequal levels: children of different links see different points of the receiver.
     */
    struct imp_elements_options o = options();
    o.eps_last = 1e-4;
    imp_elements *e = solved(s, &o);
    tap_near(imp__el_measure(e, NULL), 2.5, 0.01, 0, "furnace, refined adaptively");
    imp_elements_destroy(e);

    /* Glossy: less leaves every element than kd + ks of what arrives. */
    struct imp_elements_phong glossy = {
        sizeof glossy, "box", {0.2, 0.2, 0.2}, {0.4, 0.4, 0.4}, 10};
    double z[24], w[24], most = 0, least = 1;
    o.phong = &glossy;
    o.n_phong = 1;
    o.max_level = 2;
    o.eps_first = o.eps_last = 1e-12;
    e = solved(s, &o);
    imp__gauss_legendre(24, 0, 1, z, w);
    for (size_t k = 0; k < e->n_elements; k++) {
        const struct imp__element *x = &e->elements[k];
        double out = 0, h[EL_N_MAX];
        if (x->child) continue;
        for (int i = 0; i < 24; i++)
            for (int p = 0; p < 48; p++) {
                const double r = sqrt(1 - z[i] * z[i]), phi = IMP_2PI * p / 48;
                imp__basis_eval(&e->basis, imp__v3(r * cos(phi), r * sin(phi), z[i]), h);
                for (int q = 0; q < e->basis.n; q++)
                    out += w[i] * z[i] * IMP_2PI / 48 * h[q] * imp__el_at(e, e->l, x)[q];
            }
        const double part = out / (imp__el_at(e, e->c, x)[0] * sqrt(IMP_2PI));
        most = fmax(most, part);
        least = fmin(least, part);
    }
    tap_ok(most < 0.6 && least > 0.4,
           "glossy furnace: %.3f .. %.3f of what arrives leaves", least, most);
    tap_ok(imp__el_measure(e, NULL) < 2.5, "and nowhere more than kd + ks would give");
    imp_elements_destroy(e);
    imp_scene_destroy(s);
}

/* Equal sweeps from zero: a.l and e.(S^T g) agree to rounding, whatever the refinement.
 */
static void identity(imp_context *ctx, imp_scene *s, struct imp_elements_options o,
                     const char *name)
{
    imp_elements *e;
    bool full;
    double worst = 0;
    size_t links = 0;
    test_must(ctx, imp_elements_create(s, &o, &e));
    for (double eps = 0.05; eps > 1e-3; eps /= 3) {
        if (!e->n_links) {
            test_must(ctx, imp__el_links_first(e));
            test_must(ctx, imp__el_sources(e));
        } else {
            e->eps = eps * imp__el_total(e, !o.no_importance);
            test_must(ctx, imp__el_refine(e, !o.no_importance, &full));
        }
        test_must(ctx, imp__el_bin(e));
        for (int k = 1; k < 12; k += 5) {
            test_must(ctx, imp__el_sweep(e, k, true, true));
            const double j = imp__el_measure(e, NULL);
            worst = fmax(worst, fabs(imp__el_measure_adjoint(e) / j - 1));
            links = e->n_links;
        }
    }
    tap_ok(worst < 1e-12, "adjoint identity, %s, up to %zu links # worst %.2e", name,
           links, worst);
    test_must(ctx, imp__el_settle(e, 8, true, 1e-12));
    tap_ok(fabs(imp__el_measure_adjoint(e) / imp__el_measure(e, NULL) - 1) < 1e-10,
           "and converged # %.2e",
           imp__el_measure_adjoint(e) / imp__el_measure(e, NULL) - 1);
    imp_elements_destroy(e);
}

static const struct imp_elements_phong glossy = {
    sizeof glossy, "*", {0.1, 0.1, 0.1}, {0.6, 0.6, 0.6}, 15};
static const struct imp_elements_beam beams[4] = {
    {sizeof *beams, "light_left", {0}, 20},
    {sizeof *beams, "light_right", {0}, 20},
    {sizeof *beams, "light_ceiling", {0}, 20},
    {sizeof *beams, "light_back", {0}, 20}};

static struct imp_elements_options options_d(void)
{
    struct imp_elements_options o = options();
    o.n_phong = 1;
    o.phong = &glossy;
    o.n_beams = 4;
    o.beams = beams;
    o.eps_last = 2e-3;
    return o;
}

static void identities(imp_context *ctx, imp_scene *b, imp_scene *d)
{
    struct imp_elements_options o = options();
    identity(ctx, b, o, "scene b");
    o.no_importance = 1;
    identity(ctx, b, o, "scene b, refined without importance");
    identity(ctx, d, options_d(), "scene d");
    imp_scene *rgb = test_scene(ctx, "cornell.xml", IMP_RGB, "res=16");
    o = options();
    identity(ctx, rgb, o, "Cornell box, rgb");
    const struct imp_elements_source sources[3] = {
        {.size = sizeof *sources,
         .kind = IMP_ELEMENTS_PLANE,
         .weight = 2,
         .origin = {100, 100, 100},
         .edge_u = {0, 0, 200},
         .edge_v = {300, 0, 0}},
        {.size = sizeof *sources,
         .kind = IMP_ELEMENTS_SHAPE,
         .weight = -0.5,
         .shape = rgb->shapes[0]->name},
        {.size = sizeof *sources, .kind = IMP_ELEMENTS_CAMERA, .region = {2, 3, 9, 12}}};
    o.n_sources = 3;
    o.sources = sources;
    identity(ctx, rgb, o, "plane, wall and part of the picture together");
    imp_scene_destroy(rgb);
}

/* Derivatives against central differences of the same discrete system, Euler's budget. */
static void derivatives(imp_context *ctx, imp_scene *s,
                        const struct imp_elements_options *o, const char *param)
{
    const struct imp_elements_row *rows;
    size_t n, index;
    imp_elements *e = solved(s, o);
    test_must(ctx, imp_elements_sensitivity(e, &rows, &n));
    double share = 0, d = NAN, value, v[2];
    test_must(ctx, imp_scene_find_param(s, param, &index));
    for (size_t k = 0; k < n; k++) {
        if (rows[k].emission) share += rows[k].share;
        if (rows[k].param == (int)index) d = rows[k].derivative;
    }
    tap_near(share, 1, 1e-10, 0, "the lights' shares add up to the measurement");
    test_must(ctx, imp_scene_get_values(s, index, &value));
    const double h = 1e-4 * value;
    for (int k = 0; k < 2; k++) {
        const double x = value + (k ? h : -h);
        test_must(ctx, imp_scene_set_values(s, index, 1, &x));
        test_must(ctx, imp_elements_update(e));
        test_must(ctx, imp__el_settle(e, 8, true, 1e-14));
        v[k] = imp__el_measure(e, NULL);
    }
    test_must(ctx, imp_scene_set_values(s, index, 1, &value));
    char text[128];
    snprintf(text, sizeof text, "d/d %s against central differences", param);
    tap_near(d, (v[1] - v[0]) / (2 * h), 1e-6, 1e-12, text);
    imp_elements_destroy(e);
}

/* Phong coefficients are no parameters of the scene: new elements with other values. */
static void derivatives_phong(imp_context *ctx, imp_scene *s)
{
    const struct imp_elements_row *rows;
    size_t n;
    struct imp_elements_options o = options_d();
    o.order = 8;
    o.eps_last = 1e-3;
    imp_elements *e = solved(s, &o);
    test_must(ctx, imp_elements_sensitivity(e, &rows, &n));
    for (int which = 0; which < 2; which++) {
        double d = NAN, v[2];
        for (size_t k = 0; k < n; k++)
            if (strcmp(rows[k].name, which ? "*.phong.ks" : "*.phong.kd") == 0)
                d = rows[k].derivative;
        for (int k = 0; k < 2; k++) {
            struct imp__el_material *m = NULL;
            for (int i = 0; i < e->n_materials; i++)
                if (e->materials[i].phong) m = &e->materials[i];
            double *x = which ? &m->ks[0] : &m->kd[0];
            const double keep = *x;
            *x += k ? 1e-4 : -1e-4;
            test_must(ctx, imp__el_project(ctx, &e->arena, &e->basis, 1, "x", m));
            test_must(ctx, imp__el_settle(e, 8, true, 1e-14));
            v[k] = imp__el_measure(e, NULL);
            *x = keep;
            test_must(ctx, imp__el_project(ctx, &e->arena, &e->basis, 1, "x", m));
        }
        tap_near(d, (v[1] - v[0]) / 2e-4, 1e-6, 0,
                 which ? "d/d ks of scene d against central differences"
                       : "d/d kd of scene d against central differences");
    }
    imp_elements_destroy(e);
}

/* Christensen 1995, 8.1: tiny emitter -> tiny glossy patch -> large diffuse patch. */
static void chain(imp_context *ctx)
{
    const char *xml =
        "<scene version='3.0.0'>"
        "<sensor type='perspective'><transform name='to_world'>"
        "<lookat origin='0,0,-3' target='0,0,5' up='0,1,0'/></transform>"
        "<film type='hdrfilm'><integer name='width' value='4'/>"
        "<integer name='height' value='4'/></film></sensor>"
        "<shape type='rectangle' id='lamp'><transform name='to_world'><scale "
        "value='0.005'/>"
        "<rotate y='1' angle='90'/><translate x='-2' y='0' z='2'/></transform>"
        "<emitter type='area'><float name='radiance' value='1000'/></emitter></shape>"
        "<shape type='rectangle' id='patch'><transform name='to_world'><scale "
        "value='0.005'/>"
        "</transform></shape>"
        "<shape type='rectangle' id='wall'><transform name='to_world'><scale value='1'/>"
        "<rotate y='1' angle='-90'/><translate x='2' y='0' z='2'/></transform>"
        "<bsdf type='diffuse'><float name='reflectance' "
        "value='0.5'/></bsdf></shape></scene>";
    const struct imp_elements_phong p = {sizeof p, "patch", {0.1, 0, 0}, {0.6, 0, 0}, 15};
    const double kd = 0.1, ks = 0.6, n = 15, le = 1000, area = 1e-4;
    imp_scene *s = test_scene_text(ctx, xml, IMP_MONO);
    double before = INFINITY;
    for (int order = 4; order <= 12; order += 4) {
        struct imp_elements_options o = options();
        const struct imp_elements_source src = {
            .size = sizeof src, .kind = IMP_ELEMENTS_SHAPE, .shape = "wall"};
        o.order = order;
        o.sources = &src;
        o.n_sources = o.n_phong = 1;
        o.phong = &p;
        o.eps_last = 1e-4;
        o.max_level = 5;
        imp_elements *e = solved(s, &o);
        /* L2(w) = f(w12, w) G12 Le A1, with w12 at 45 degrees and cos 45 at both ends. */
        const double g12 = 0.5 / 8 * le * area;
        const imp_v3 wi = imp__v3(-sqrt(0.5), 0, sqrt(0.5));
        const struct imp__element *x = NULL;
        for (size_t k = 0; k < e->n_elements; k++)
            if (imp__el_root_of(e, &e->elements[k])->shape == 1 &&
                e->elements[k].parent == EL_NONE)
                x = &e->elements[k];
        double apart = 0, sum = 0;
        for (int a = 0; a < 40; a++)
            for (int b = 0; b < 80; b++) {
                const double z = (a + 0.5) / 40, r = sqrt(1 - z * z),
                             phi = IMP_2PI * b / 80;
                const imp_v3 w = imp__v3(r * cos(phi), r * sin(phi), z);
                double h[EL_N_MAX], l = 0;
                imp__basis_eval(&e->basis,
                                imp__to_local(&imp__el_root_of(e, x)->frame, w), h);
                for (int q = 0; q < e->basis.n; q++)
                    l += imp__el_at(e, e->l, x)[q] * h[q];
                const double t = z * wi[2] - w[0] * wi[0] - w[1] * wi[1];
                const double want =
                    g12 * (kd / IMP_PI + ks * (n + 2) / IMP_2PI * pow(fmax(0, t), n));
                apart += (l - want) * (l - want);
                sum += want * want;
            }
        const double error = sqrt(apart / sum);
        tap_ok(error < before && error < (order == 12 ? 0.06 : 1),
               "chain, order %d: the glossy patch's radiance # relative L2 error %.4f",
               order, error);
        before = error;
        /* Irradiance of the wall: the lamp's is seen at grazing 0.. here face to face. */
        double irradiance = 0;
        const int m = 200;
        for (int a = 0; a < m; a++)
            for (int b = 0; b < m; b++) {
                const imp_v3 y =
                    imp__v3(2, -1 + (a + 0.5) * 2 / m, 1 + (b + 0.5) * 2 / m);
                const double r2 = imp__dot(y, y), r = sqrt(r2);
                const imp_v3 w = y * (1 / r);
                const double t = w[2] * wi[2] - w[0] * wi[0] - w[1] * wi[1];
                const double l =
                    g12 * (kd / IMP_PI + ks * (n + 2) / IMP_2PI * pow(fmax(0, t), n));
                const imp_v3 d = y - imp__v3(-2, 0, 2);
                const double d2 = imp__dot(d, d);
                irradiance +=
                    l * area * w[2] * w[0] / r2 + le * area * d[0] * d[0] / (d2 * d2);
            }
        irradiance /= m * m;
        if (order == 12)
            tap_near(imp__el_measure(e, NULL), irradiance, 3e-3, 0,
                     "chain: mean irradiance of the wall");
        imp_elements_destroy(e);
    }
    imp_scene_destroy(s);
}

static void same_bits(imp_scene *d1, const char *xml_defines)
{
    imp_context *three = test_context(3);
    imp_scene *d3 = test_scene(three, "elements/d.xml", IMP_MONO, xml_defines);
    struct imp_elements_options o = options_d();
    o.eps_last = 1e-3;
    imp_elements *a = solved(d1, &o), *b = solved(d3, &o);
    imp_film *f[2];
    test_must(d1->ctx, imp_elements_image(a, 0, IMP_ELEMENTS_FLAT, 2, &f[0]));
    test_must(three, imp_elements_image(b, 0, IMP_ELEMENTS_FLAT, 2, &f[1]));
    tap_ok(a->n_links == b->n_links && a->n_coef == b->n_coef &&
               memcmp(a->l, b->l, a->n_coef * sizeof *a->l) == 0 &&
               memcmp(a->g, b->g, a->n_coef * sizeof *a->g) == 0 &&
               memcmp(f[0]->mean, f[1]->mean, imp__film_values(f[0]) * sizeof(float)) ==
                   0,
           "one thread and three: the same bits # %zu links", a->n_links);
    imp_film_destroy(f[0]);
    imp_film_destroy(f[1]);
    imp_elements_destroy(a);
    imp_elements_destroy(b);
    imp_scene_destroy(d3);
    imp_context_destroy(three);
}

static void files(imp_context *ctx, imp_scene *s)
{
    char path[64] = "/tmp/importon-elements-XXXXXX";
    const int fd = mkstemp(path);
    if (fd < 0) {
        tap_skip("files", "no temporary file");
        return;
    }
    struct imp_elements_options o = options_d();
    imp_elements *a = solved(s, &o), *b = NULL;
    imp_film *f[2];
    test_must(ctx, imp_elements_save(a, path));
    test_must(ctx, imp_elements_open(s, &o, path, &b));
    for (enum imp_elements_image kind = IMP_ELEMENTS_FLAT;
         kind <= IMP_ELEMENTS_IMPORTANCE; kind++) {
        test_must(ctx, imp_elements_image(a, 0, kind, 1, &f[0]));
        test_must(ctx, imp_elements_image(b, 0, kind, 1, &f[1]));
        tap_ok(memcmp(f[0]->mean, f[1]->mean, imp__film_values(f[0]) * sizeof(float)) ==
                   0,
               "reopened: picture %d has the same bits", (int)kind);
        imp_film_destroy(f[0]);
        imp_film_destroy(f[1]);
    }
    imp_elements_destroy(b);
    struct imp_elements_options other = o;
    other.n_phong = 0;
    const enum imp_status st = imp_elements_open(s, &other, path, &b);
    tap_ok(st == IMP_E_SCENE, "another material is refused # %s", imp_last_error(ctx));
    /* Damage: cuts, one bit flipped at places all over the file, 3,000 bytes zeroed, and
     * the version before this one. */
    FILE *file = fopen(path, "rb");
    static unsigned char data[8 << 20], bad[8 << 20];
    const size_t size = file ? fread(data, 1, sizeof data, file) : 0;
    if (file) fclose(file);
    int refused = 0, named = 0;
    enum { CUTS = 20, FLIPS = 60, ZEROED = 8, ALL = CUTS + FLIPS + ZEROED + 1 };
    for (int k = 0; k < ALL && size > 4000; k++) {
        const size_t cut = k < CUTS ? size * (size_t)k / CUTS : size;
        memcpy(bad, data, size);
        if (k == ALL - 1) bad[7] = '1';
        else if (k >= CUTS + FLIPS)
            memset(bad + (size - 3000) * (size_t)(k - CUTS - FLIPS + 1) / (ZEROED + 1), 0,
                   3000);
        else if (k >= CUTS)
            bad[k < CUTS + 20 ? (size_t)(k - CUTS) * 4
                              : size * (size_t)(k - CUTS - 20) / (FLIPS - 20)] ^=
                (unsigned char)(1 << k % 8);
        file = fopen(path, "wb");
        if (file) fwrite(bad, 1, cut, file), fclose(file);
        b = NULL;
        const enum imp_status damage = imp_elements_open(s, &o, path, &b);
        refused += damage != IMP_OK && b == NULL;
        named += strstr(imp_last_error(ctx), path) != NULL;
        imp_elements_destroy(b);
    }
    tap_ok(size > 4000 && refused == ALL && named == ALL,
           "damaged files are refused by name # %d, %d of %d: %s", refused, named, ALL,
           imp_last_error(ctx));
    close(fd);
    unlink(path);
    imp_elements_destroy(a);
}

/* ---- Refusals and hostile scenes ----------------------------------------------- */

static void refuses(imp_context *ctx, const char *shape, enum imp_status want,
                    const char *word)
{
    char xml[2048];
    snprintf(xml, sizeof xml,
             "<scene version='3.0.0'><sensor type='perspective'/>%s"
             "<shape type='rectangle'><emitter type='area'/></shape></scene>",
             shape);
    imp_scene *s = test_scene_text(ctx, xml, IMP_RGB);
    imp_elements *e = NULL;
    const enum imp_status st = imp_elements_create(s, NULL, &e);
    tap_ok(st == want && !e && strstr(imp_last_error(ctx), word), "refused # %s",
           imp_last_error(ctx));
    imp_elements_destroy(e);
    imp_scene_destroy(s);
}

static int stop_at_once(const struct imp_progress *p, void *payload)
{
    int *count = payload;
    (void)p;
    return ++*count > 1;
}

static void hostile(imp_context *ctx)
{
    refuses(ctx, "<shape type='sphere' id='ball'/>", IMP_E_UNSUPPORTED, "ball");
    refuses(ctx, "<shape type='cube' id='glass'><bsdf type='dielectric'/></shape>",
            IMP_E_UNSUPPORTED, "glass");
    refuses(ctx, "<shape type='cube' id='mirror'><bsdf type='conductor'/></shape>",
            IMP_E_UNSUPPORTED, "mirror");
    refuses(
        ctx,
        "<shape type='cube' id='tiles'><bsdf type='diffuse'><texture name='reflectance' "
        "type='checkerboard'/></bsdf></shape>",
        IMP_E_UNSUPPORTED, "tiles");
    refuses(ctx,
            "<shape type='cube' id='polish'><bsdf type='roughconductor'>"
            "<float name='alpha' value='0.02'/></bsdf></shape>",
            IMP_E_UNSUPPORTED, "polish");
    refuses(ctx, "<emitter type='point' id='bulb'/>", IMP_E_UNSUPPORTED, "bulb");
    refuses(ctx, "<emitter type='constant' id='sky'/>", IMP_E_UNSUPPORTED, "sky");

    /* Coplanar and touching squares, a sliver, a point, both sides, albedo 1. */
    const char *xml =
        "<scene version='3.0.0'><sensor type='perspective'><transform name='to_world'>"
        "<lookat origin='0,0,4' target='0,0,0' up='0,1,0'/></transform>"
        "<film type='hdrfilm'><integer name='width' value='8'/>"
        "<integer name='height' value='8'/></film></sensor>"
        "<shape type='rectangle' id='a'/><shape type='rectangle' id='b'/>"
        "<shape type='rectangle' id='c'><transform name='to_world'><translate "
        "x='2'/></transform>"
        "</shape><shape type='rectangle' id='thin'><transform name='to_world'>"
        "<scale x='1e-7' y='1' z='1'/><rotate y='1' angle='90'/></transform></shape>"
        "<shape type='rectangle' id='both'><transform name='to_world'><rotate x='1' "
        "angle='90'/>"
        "</transform><bsdf type='twosided'><bsdf type='diffuse'>"
        "<rgb name='reflectance' value='1,1,1'/></bsdf></bsdf></shape>"
        "<shape type='rectangle' id='lamp'><transform name='to_world'><rotate y='1' "
        "angle='180'/>"
        "<translate z='6'/></transform><emitter type='area'/></shape></scene>";
    imp_scene *s = test_scene_text(ctx, xml, IMP_RGB);
    struct imp_elements_options o = options();
    o.eps_last = 5e-3;
    imp_elements *e = solved(s, &o);
    struct imp_elements_info info = {.size = sizeof info};
    test_must(ctx, imp__el_settle(e, 8, true, 1e-12));
    test_must(ctx, imp_elements_get_info(e, &info));
    tap_ok(isfinite(info.measure) && info.measure > 0 && info.polygons == 8 &&
               fabs(info.measure_adjoint / info.measure - 1) < 1e-6,
           "touching, coplanar, thin and two-sided: still a solution # %.6f, %zu links",
           info.measure, info.links);
    imp_elements_destroy(e);
    /* Budgets hold, and a stopped run leaves a valid solution. */
    o.eps_last = 1e-6;
    o.max_links = 500;
    e = solved(s, &o);
    tap_ok(e->n_links <= 500 && strstr(e->reason, "budget"),
           "a budget of 500 links # %zu links", e->n_links);
    imp_elements_destroy(e);
    int count = 0;
    o.max_links = 0;
    o.progress = stop_at_once;
    o.progress_payload = &count;
    test_must(ctx, imp_elements_create(s, &o, &e));
    imp_film *film = NULL;
    const enum imp_status st = imp_elements_solve(e);
    tap_ok(st == IMP_CANCELLED &&
               imp_elements_image(e, 0, IMP_ELEMENTS_GOURAUD, 1, &film) == IMP_OK,
           "a stopped run has a coarser solution # %zu links", e->n_links);
    imp_film_destroy(film);
    imp_elements_destroy(e);
    imp_scene_destroy(s);

    /* 70 x 71 quadrilaterals, not planar: the estimate comes before the work. */
    enum { NX = 36, NY = 71 };
    static float p[3 * (NX + 1) * (NY + 1)];
    static uint32_t t[6 * NX * NY];
    for (int y = 0; y <= NY; y++)
        for (int x = 0; x <= NX; x++) {
            float *v = p + 3 * (y * (NX + 1) + x);
            v[0] = (float)x / NX;
            v[1] = (float)y / NY;
            v[2] = 0.2f * sinf(7 * v[0]) * cosf(5 * v[1]);
        }
    for (int y = 0, k = 0; y < NY; y++)
        for (int x = 0; x < NX; x++) {
            const uint32_t a = (uint32_t)(y * (NX + 1) + x), b = a + NX + 1;
            t[k++] = a, t[k++] = a + 1, t[k++] = b + 1;
            t[k++] = a, t[k++] = b + 1, t[k++] = b;
        }
    test_must(ctx, imp_scene_create(ctx, NULL, &s));
    imp_scene_begin(s, "sensor", "perspective", NULL, NULL);
    imp_scene_end(s);
    imp_scene_begin(s, "shape", "mesh", "sheet", NULL);
    imp_scene_bool(s, "face_normals", 1);
    imp_scene_mesh(s, (NX + 1) * (NY + 1), 2 * NX * NY, p, NULL, NULL, t);
    imp_scene_begin(s, "emitter", "area", NULL, NULL);
    imp_scene_end(s);
    imp_scene_begin(s, "bsdf", "diffuse", NULL, NULL);
    imp_scene_end(s);
    imp_scene_end(s);
    test_must(ctx, imp_scene_commit(s));
    o = options();
    o.max_links = 100000;
    test_must(ctx, imp_elements_create(s, &o, &e));
    const enum imp_status refused = imp_elements_solve(e);
    tap_ok(e->n_roots > 5000 && refused == IMP_E_NOMEM &&
               strstr(imp_last_error(ctx), "budget"),
           "%zu polygons # %s", e->n_roots, imp_last_error(ctx));
    imp_elements_destroy(e);
    imp_scene_destroy(s);
}

/* The integrator of a scene file: its settings, the film's pixel formats, cancel. */
static imp_scene *integrated(imp_context *ctx, const char *integrator, const char *format)
{
    char xml[2048];
    snprintf(xml, sizeof xml,
             "<scene version='3.0.0'>%s"
             "<sensor type='perspective'><transform name='to_world'>"
             "<lookat origin='0,0,4' target='0,0,0' up='0,1,0'/></transform>"
             "<float name='fov' value='60'/><film type='hdrfilm'>"
             "<string name='pixel_format' value='%s'/>"
             "<integer name='width' value='8'/><integer name='height' "
             "value='8'/></film></sensor>"
             "<shape type='rectangle' id='wall'>"
             "<bsdf type='diffuse'><rgb name='reflectance' value='.2,.4,.6'/></bsdf>"
             "</shape><shape type='rectangle' id='lamp'><transform name='to_world'>"
             "<rotate y='1' angle='180'/><translate z='6'/></transform>"
             "<emitter type='area'><rgb name='radiance' value='3,2,1'/></emitter>"
             "</shape></scene>",
             integrator, format);
    return test_scene_text(ctx, xml, IMP_RGB);
}

static void integrator(imp_context *ctx)
{
    static const char text[] = "<integrator type='elements'><integer name='order' "
                               "value='4'/><float name='eps' value='1e-3'/>"
                               "<string name='image' value='flat'/></integrator>";
    struct imp_elements_options o = IMP_ELEMENTS_OPTIONS_INIT;
    struct imp_run run = IMP_RUN_INIT;
    imp_scene *a = integrated(ctx, text, "rgba"), *b = integrated(ctx, "", "rgb");
    imp_film *x, *y;
    run.spp = 15; /* rounded up to a square */
    test_must(ctx, imp_render(a, &run, &x));
    o.order = 4;
    o.eps_last = 1e-3;
    imp_elements *e = solved(b, &o), *defaults = solved(a, NULL);
    test_must(ctx, imp_elements_image(e, 0, IMP_ELEMENTS_FLAT, 4, &y));
    bool same = x->channels == 4 && y->channels == 3 && x->spp == 16;
    double inside = 0;
    for (int k = 0; k < 64; k++) {
        for (int c = 0; c < 3 && same; c++)
            same = x->mean[4 * k + c] == y->mean[3 * k + c];
        inside += x->mean[4 * k + 3] / 64;
    }
    /* A wall 2 wide in a field of 8 tan 30; the lamp is behind the eye. */
    const double area = 4 / imp__sqr(8 * tan(IMP_PI / 6));
    tap_ok(same, "integrator elements: imp_render equals imp_elements_image");
    tap_near(inside, area, 0.1, 0, "its alpha is the area that surfaces cover");
    tap_ok(defaults->opt.order == 4 && defaults->n_links == e->n_links,
           "its settings are the defaults of imp_elements_create");
    imp_film_destroy(x);
    imp_film_destroy(y);
    imp_elements_destroy(e);
    imp_elements_destroy(defaults);
    int count = 1;
    run.progress = stop_at_once;
    run.progress_payload = &count;
    x = NULL;
    const enum imp_status st = imp_render(a, &run, &x);
    tap_ok(st == IMP_CANCELLED && x && x->channels == 4, "cancelled: a picture is there");
    imp_film_destroy(x);
    imp_problem *p = test_problem(ctx, a, "*");
    float seed[8 * 8 * 3] = {0};
    double g[64];
    tap_ok(imp_problem_reverse(p, seed, NULL, g, NULL) == IMP_E_UNSUPPORTED &&
               strstr(imp_last_error(ctx), "sensitivity"),
           "no gradients by walks # %s", imp_last_error(ctx));
    imp_problem_destroy(p);
    imp_scene_destroy(a);
    imp_scene_destroy(b);
    static const char *const bad[] = {
        "<integrator type='elements'><integer name='order' value='1'/></integrator>",
        "<integrator type='elements'><float name='stop' value='-1'/></integrator>",
        "<integrator type='elements'><integer name='max_depth' value='3'/></integrator>",
        "<integrator type='elements'><string name='image' value='x'/></integrator>",
        "<integrator type='moment'><integrator type='elements'/></integrator>"};
    for (size_t k = 0; k < sizeof bad / sizeof *bad; k++) {
        char xml[512];
        imp_scene *s;
        snprintf(xml, sizeof xml, "<scene version='3.0.0'>%s</scene>", bad[k]);
        const enum imp_status refused =
            imp_scene_load_string(ctx, xml, strlen(xml), "t", NULL, &s);
        tap_ok(refused == IMP_E_SCENE || refused == IMP_E_UNSUPPORTED, "refused # %s",
               imp_last_error(ctx));
    }
}

/* Kinds phong and beam of a file are what the options make of d.xml. */
static void kinds(imp_context *ctx, imp_scene *d)
{
    static const struct imp_elements_phong wall = {
        sizeof wall, "*", {0.1, 0.1, 0.1}, {0.6, 0.6, 0.6}, 15};
    struct imp_elements_beam beams[4] = {{sizeof *beams, "light_left", {0}, 20},
                                         {sizeof *beams, "light_right", {0}, 20},
                                         {sizeof *beams, "light_ceiling", {0}, 20},
                                         {sizeof *beams, "light_back", {0}, 20}};
    struct imp_elements_options o = options();
    imp_scene *s = test_scene(ctx, "elements/glossy.xml", IMP_MONO, "res=24");
    const struct imp_elements_row *rows;
    size_t n;
    o.order = 4;
    o.eps_last = 1e-2;
    imp_elements *a = solved(s, &o);
    o.phong = &wall;
    o.n_phong = 1;
    o.beams = beams;
    o.n_beams = 4;
    imp_elements *b = solved(d, &o);
    tap_near(imp__el_measure(a, NULL), imp__el_measure(b, NULL), 1e-10, 0,
             "kinds phong and beam are --phong and --beam");
    test_must(ctx, imp_elements_sensitivity(a, &rows, &n));
    bool exponent = false, flat = false;
    for (size_t k = 0; k < n; k++) {
        exponent |= strcmp(rows[k].name, "wall.exponent.value") == 0;
        flat |= strcmp(rows[k].name, "light_left.emitter.radiance.value") == 0;
    }
    tap_ok(exponent && flat, "with derivatives by the exponent and by the lamps");
    imp_elements_destroy(a);
    imp_elements_destroy(b);
    o.n_phong = o.n_beams = 0;
    derivatives(ctx, s, &o, "wall.exponent");
    derivatives(ctx, s, &o, "wall.specular_reflectance.value");
    imp_scene_destroy(s);
}

int main(void)
{
    imp_context *ctx = test_context(1);
    imp_scene *b = test_scene(ctx, "elements/b.xml", IMP_MONO, "res=24");
    imp_scene *d = test_scene(ctx, "elements/d.xml", IMP_MONO, "res=24");
    furnace(ctx);
    identities(ctx, b, d);
    struct imp_elements_options o = options();
    o.eps_last = 1e-3;
    derivatives(ctx, b, &o, "wall.reflectance");
    derivatives(ctx, b, &o, "light_left.emitter.radiance");
    derivatives_phong(ctx, d);
    chain(ctx);
    same_bits(d, "res=24");
    files(ctx, d);
    hostile(ctx);
    integrator(ctx);
    kinds(ctx, d);
    imp_scene_destroy(b);
    imp_scene_destroy(d);
    imp_context_destroy(ctx);
    return tap_done();
}
