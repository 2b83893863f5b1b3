/* SPDX-License-Identifier: Apache-2.0
 *
 * Adjoint photons (integrator photons) where the answer is known: a furnace with depth cap
 * and roulette h, directional albedos against quadrature, gradients that do not depend on
 * h, lights that no photon meets; frozen, fresh and exact checks of their gradients.
 *
 * Negative controls: slips of the text of Morley et al. (2006), planted into walks of this
 * library or into a walk of this test's own, give the wrong number that each must give. */
#include "math/warp.h"
#include "photon_walks.h"

static imp_context *ctx;

#define CAUGHT 5 /* |z|: once in 2 million by chance */
static void expect(bool same, const struct tap_stat *stat, double ref, const char *what)
{
    const double se = tap_se(stat) + 1e-12, z = (stat->mean - ref) / se;
    tap_ok(same ? fabs(z) <= 4.5 : fabs(z) > CAUGHT,
           "%s %s # mean %.5f se %.5f reference %.5f z %.1f", what,
           same ? "is right" : "is caught", stat->mean, se, ref, z);
}

/* ---- A furnace: a sphere seen from inside, that glows with e and reflects rho ------- */

#define FURNACE                                                                          \
    "<scene version='3.0.0'><integrator type='photons'><integer name='max_depth' "       \
    "value='%d'/><float name='h' value='%g'/><string name='weights' value='%s'/>"        \
    "</integrator><sensor type='perspective'><float name='fov' value='60'/>"             \
    "<film type='hdrfilm'><integer name='width' value='4'/><integer name='height' "      \
    "value='4'/><rfilter type='box'/></film></sensor><shape type='sphere'><float "       \
    "name='radius' value='%g'/><boolean name='flip_normals' value='true'/><bsdf "        \
    "type='%s' id='wall'><float name='%s' value='%g'/></bsdf><emitter type='area' "      \
    "id='glow'><float name='radiance' value='.2'/></emitter></shape></scene>"

struct furnace {
    int depth;
    double h, radius, rho;
    const char *weights, *type, *property;
};

static imp_scene *furnace_make(const struct furnace *f)
{
    char xml[2048];
    snprintf(xml, sizeof xml, FURNACE, f->depth, f->h, f->weights, f->radius, f->type,
             f->property, f->rho);
    return test_scene_text(ctx, xml, IMP_MONO);
}
/* e (1 + rho + ... + rho^(depth - 1)) */
static double furnace_truth(double e, double rho, int depth)
{
    return depth < 0 ? e / (1 - rho) : e * (1 - pow(rho, depth)) / (1 - rho);
}

/* Value and dL/drho. */
static void furnace_gradient(const struct furnace *f, struct imp_estimate *value,
                             double *g, double *se)
{
    imp_scene *scene = furnace_make(f);
    imp_problem *p = test_problem(ctx, scene, "wall.*");
    struct imp_run run = IMP_RUN_INIT;
    run.spp = 20000;
    run.seed = 11;
    test_must(ctx, imp_problem_functional(p, NULL, &run, value, g, se));
    imp_problem_destroy(p);
    imp_scene_destroy(scene);
}

static void roulette(void)
{
    static const char *const weights[] = {"kernel=1", "kernel=1,emitters=1",
                                          "kernel=1,uniform=2"};
    static const double h[] = {.8, .9, 1, 3};
    const double rho = .6;
    for (int depth = -1; depth < 6; depth += 5 + (depth > 0)) /* -1, 4 */
        for (int k = 0; k < 3; k++) {
            double variance = 0, length = 0;
            for (int i = 0; i < 4; i++) {
                if (depth < 0 && h[i] * rho >= 1) continue; /* nothing would end it */
                const struct furnace f = {depth,     h[i],         1, rho, weights[k],
                                          "diffuse", "reflectance"};
                struct photons p = photons_open(ctx, furnace_make(&f), 3);
                struct photon_mean m = photons_mean(&p, 100000);
                char what[96];
                snprintf(what, sizeof what, "furnace, depth %d, h %g, %s", depth, h[i],
                         weights[k]);
                const double truth = furnace_truth(.2, rho, depth);
                if (photon_variance(&m) > 0) tap_z(&m.L, truth, .01, what);
                else tap_near(m.L.mean, truth, 1e-6, 0, what);
                if (i > 0)
                    tap_ok(photon_variance(&m) < variance * 1.05 && m.segments > length,
                           "%s: less variance, longer walks # %.4g segments %.3f", what,
                           photon_variance(&m), m.segments);
                variance = photon_variance(&m);
                length = m.segments;
                photons_close(&p);
            }
        }
    /* d/drho e/(1 - rho) = e/(1 - rho)^2 */
    for (int i = 0; i < 3; i++) {
        const struct furnace f = {-1, h[i], 1, rho, weights[i], "diffuse", "reflectance"};
        struct imp_estimate value;
        double g, se;
        furnace_gradient(&f, &value, &g, &se);
        const double z = (g - .2 / .16) / se;
        tap_ok(fabs(z) <= 4 && se < .01 * 1.25,
               "dL/drho at h %g, %s # %.5f se %.5f ref 1.25 z %.2f", h[i], weights[i], g,
               se, z);
    }
    /* Black walls: the derivative at rho = 0 is e. */
    const struct furnace black = {-1, 1, 1, 0, "kernel=1", "diffuse", "reflectance"};
    struct imp_estimate value;
    double g, se;
    furnace_gradient(&black, &value, &g, &se);
    tap_ok(fabs(g - .2) <= 4 * se + 1e-6 && se < .002,
           "dL/drho of a black wall # %.5f se %.5f ref 0.2", g, se);
}

/* ---- Directional albedo ---------------------------------------------------------- */

/* Of every kind that knows it: the integral of its value, against draws. */
static void albedos(void)
{
    static const struct {
        const char *type, *inside;
    } row[] = {{"diffuse", "<rgb name='reflectance' value='.7,.3,.2'/>"},
               {"conductor", "<string name='material' value='Au'/>"},
               {"dielectric", "<rgb name='specular_reflectance' value='.9,.8,.7'/><rgb "
                              "name='specular_transmittance' value='.5,.6,.7'/>"},
               {"null", ""},
               {"stam_m3", "<float name='diffuse' value='.4'/>"},
               {"twosided", "<bsdf type='diffuse'/>"}};
    static const imp_v3 direction[] = {
        {0, 0, 1, 0}, {.6, 0, .8, 0}, {.8, .5, -.3, 0}, {0, .995, .0998, 0}};
    for (size_t r = 0; r < sizeof row / sizeof *row; r++) {
        char xml[1024];
        snprintf(xml, sizeof xml,
                 "<scene version='3.0.0'><integrator type='photons'/><sensor "
                 "type='perspective'/><shape type='sphere'><bsdf type='%s'>%s</bsdf>"
                 "</shape></scene>",
                 row[r].type, row[r].inside);
        imp_scene *s = test_scene_text(ctx, xml, IMP_RGB);
        const struct imp_bsdf *b = s->bsdfs[s->shapes[0]->bsdf];
        const struct imp_texcoord at = {.uv = {.5, .5}};
        imp_spec in[IMP_INPUTS_MAX];
        imp__inputs_eval(b->input, b->n_in, &at, in);
        for (size_t k = 0; k < sizeof direction / sizeof *direction; k++) {
            const imp_v3 wo = imp__normalize(direction[k]);
            struct tap_stat sum = {0};
            imp_spec H;
            char what[96];
            snprintf(what, sizeof what, "albedo of %s, cosine %.2f", row[r].type, wo[2]);
            if (!b->ops->directional_albedo(b, in, &wo, &H)) {
                tap_ok(false, "%s is known", what);
                continue;
            }
            for (uint32_t i = 0; i < 20000; i++) {
                const struct imp_key key = imp__key(17, r, i);
                const double u[3] = {imp__u01(key, 0), imp__u01(key, 1),
                                     imp__u01(key, 2)};
                struct imp_dirs d = {.wo = wo, .lobe = IMP_SMOOTH};
                double value = 0;
                imp_spec f;
                if (b->ops->sample(b, in, u, &d)) {
                    const double pdf = b->ops->pdf(b, in, &d);
                    const double n =
                        b->ops->index_ratio ? b->ops->index_ratio(b, in, &d) : 1;
                    b->ops->eval(b, in, &d, &f);
                    if (pdf > 0) value = f[1] / pdf * n * n;
                }
                tap_add(&sum, value);
            }
            const double se = tap_se(&sum);
            tap_ok(fabs(sum.mean - H[1]) <= 4.5 * se + 1e-9,
                   "%s # %.6f drawn %.6f se %.6f", what, H[1], sum.mean, se);
        }
        imp_scene_destroy(s);
    }
}

/* Kinds that do not know it: the weight of the direction that was drawn takes its place.
 * A glowing sphere of the kind, seen from inside, about a ball of it, by two settings of h
 * and two mixtures, against walks of `path` that nothing ends before their cap; dL/de,
 * which is L/e, with the same roulette. */
static void drawn_weights(void)
{
    static const struct {
        const char *type, *inside;
    } row[] = {{"roughconductor", "<string name='material' value='Cu'/><float "
                                  "name='alpha' value='.3'/>"},
               {"roughplastic", "<float name='alpha' value='.2'/>"},
               {"plastic", ""},
               {"phong", "<float name='exponent' value='8'/>"},
               {"principled",
                "<float name='roughness' value='.4'/><float name='metallic' "
                "value='.5'/>"}};
    static const char *const setting[] = {
        "type='path'><integer name='rr_depth' value='100'/>",
        "type='photons'><float name='h' value='.5'/>",
        "type='photons'><float name='h' value='.9'/>",
        "type='photons'><float name='h' value='1'/><string name='weights' "
        "value='kernel=1,uniform=1'/>"};
    for (size_t r = 0; r < sizeof row / sizeof *row; r++) {
        struct tap_stat truth = {0};
        for (size_t k = 0; k < sizeof setting / sizeof *setting; k++) {
            char xml[4096], what[96];
            snprintf(xml, sizeof xml,
                     "<scene version='3.0.0'><integrator %s<integer name='max_depth' "
                     "value='5'/></integrator><sensor type='perspective'><float "
                     "name='fov' value='60'/><transform name='to_world'><lookat "
                     "origin='0,0,-1.5' target='0,0,0' up='0,1,0'/></transform><film "
                     "type='hdrfilm'><integer name='width' value='4'/><integer "
                     "name='height' value='4'/><rfilter type='box'/></film></sensor>"
                     "<bsdf type='%s' id='wall'>%s</bsdf><shape type='sphere'><float "
                     "name='radius' value='2'/><boolean name='flip_normals' "
                     "value='true'/><ref id='wall'/><emitter type='area' id='glow'>"
                     "<float name='radiance' value='.2'/></emitter></shape><shape "
                     "type='sphere'><float name='radius' value='.6'/><ref id='wall'/>"
                     "</shape></scene>",
                     setting[k], row[r].type, row[r].inside);
            struct photons p = photons_open(ctx, test_scene_text(ctx, xml, IMP_MONO), 21);
            const struct imp_bsdf *b = p.scene->bsdfs[p.scene->shapes[0]->bsdf];
            const struct photon_mean m = photons_mean(&p, 40000);
            snprintf(what, sizeof what, "%s without H, setting %zu", row[r].type, k);
            if (k == 0) {
                tap_ok(!b->ops->directional_albedo, "%s does not know its albedo",
                       row[r].type);
                truth = m.L;
            } else {
                tap_same(&m.L, &truth, what);
            }
            photons_close(&p);
            if (k != 1) continue;
            imp_scene *scene = test_scene_text(ctx, xml, IMP_MONO);
            imp_problem *problem = test_problem(ctx, scene, "glow.*");
            struct imp_run run = IMP_RUN_INIT;
            struct imp_estimate value;
            double g, se;
            run.spp = 2500;
            run.seed = 4;
            test_must(ctx, imp_problem_functional(problem, NULL, &run, &value, &g, &se));
            const double z = (g - truth.mean / .2) / hypot(se, tap_se(&truth) / .2);
            tap_ok(fabs(z) < 4.5 && se < .02 * g, "%s: dL/de # %.4f se %.4f z %.2f",
                   row[r].type, g, se, z);
            imp_problem_destroy(problem);
            imp_scene_destroy(scene);
        }
    }
}

/* ---- What is refused ------------------------------------------------------------- */

static void refused(void)
{
    static const char *const light[] = {"<emitter type='point' id='bulb'/>"};
    for (size_t k = 0; k < sizeof light / sizeof *light; k++) {
        char xml[512];
        struct imp_load_options o = IMP_LOAD_OPTIONS_INIT;
        imp_scene *scene = NULL;
        snprintf(xml, sizeof xml,
                 "<scene version='3.0.0'><integrator type='photons'/>%s<shape "
                 "type='sphere'/></scene>",
                 light[k]);
        const enum imp_status st =
            imp_scene_load_string(ctx, xml, strlen(xml), "test", &o, &scene);
        tap_ok(st == IMP_E_UNSUPPORTED && strstr(imp_last_error(ctx), "'bulb'"),
               "a light without a surface is refused by name # %s", imp_last_error(ctx));
        imp_scene_destroy(scene);
    }
}

/* ---- Checks of gradients --------------------------------------------------------- */

static void checks(void)
{
    static const char *const setting[] = {
        "type='photons'><float name='h' value='.9'/><string name='weights' "
        "value='kernel=1,emitters=1,proxies=.5,uniform=.2'/>",
        "type='path'><string name='weights' value='kernel=1,emitters=1,environment=1'/>"
        "<integer name='split' value='2'/>"};
    for (int k = 0; k < 2; k++) {
        char xml[4096];
        snprintf(
            xml, sizeof xml,
            "<scene version='3.0.0'><integrator %s<integer name='max_depth' value='5'/>"
            "</integrator><sensor type='perspective'><float name='fov' value='30'/>"
            "<transform name='to_world'><lookat origin='0,3,6' target='0,.3,0' "
            "up='0,1,0'/></transform><film type='hdrfilm'><integer name='width' "
            "value='4'/><integer name='height' value='4'/><rfilter type='box'/></film>"
            "</sensor><emitter type='constant' id='sky'><float name='radiance' "
            "value='.3'/></emitter><shape type='rectangle'><transform name='to_world'>"
            "<rotate x='1' angle='-90'/><scale value='4'/></transform><bsdf "
            "type='diffuse' id='floor'/></shape><shape type='sphere'><float "
            "name='radius' value='.8'/><bsdf type='phong' id='gloss'><float "
            "name='exponent' value='6'/></bsdf></shape><shape type='sphere'><point "
            "name='center' x='1' y='2' z='0'/><float name='radius' value='.5'/><emitter "
            "type='area' id='lamp'><float name='radiance' value='4'/></emitter></shape>"
            "<shape type='disk' name='proxy'><transform name='to_world'><rotate x='1' "
            "angle='90'/><translate y='1.5'/></transform></shape></scene>",
            setting[k]);
        imp_scene *scene = test_scene_text(ctx, xml, IMP_MONO);
        imp_problem *p = test_problem(ctx, scene, "*");
        struct imp_run run = IMP_RUN_INIT;
        struct imp_check_options o = IMP_CHECK_OPTIONS_INIT;
        const struct imp_check_row *rows;
        size_t n, failed = 0, frozen = 0;
        double worst = 0;
        run.spp = 256;
        run.seed = 5;
        o.draws_s = 0.02;
        o.paths = 300;
        test_must(ctx, imp_check(p, &o, &run, &rows, &n));
        for (size_t i = 0; i < n; i++) {
            if (rows[i].ok == 0)
                printf("# %s %s %g %g %g\n", rows[i].method,
                       rows[i].param ? rows[i].param : "", rows[i].value,
                       rows[i].reference, rows[i].error);
            failed += rows[i].ok == 0;
            if (strcmp(rows[i].method, "frozen") == 0 && rows[i].limit > 0) {
                frozen++;
                worst = fmax(worst, rows[i].error);
            }
        }
        tap_ok(failed == 0 && frozen >= 4 && n > 20,
               "%s: the gradient's checks # %zu rows, frozen to %.1e",
               k ? "path, split" : "photons", n, worst);
        imp_problem_destroy(p);
        imp_scene_destroy(scene);
    }
}

/* ---- Slips of the text ------------------------------------------------------------ */

/* The pseudo-code of sections 3 and 4 in the furnace, where every hit is alike: analog
 * photons, and those with a factor h. */
enum slip { NO_SLIP, ME1_AREA, ME7_NO_CLAMP };

static double pseudo_code(enum slip slip, struct imp_key key, const struct furnace *f,
                          double e)
{
    const double area = 2 * IMP_2PI * imp__sqr(f->radius);
    const double H = f->rho * (slip == ME1_AREA ? area : 1); /* int .. dA' dOmega' */
    double R = 0, E = 1;
    for (int k = 0; k < f->depth; k++) {
        R += E * e;
        /* "if random < H h": H h above 1 is always survived, */
        const double s = slip == ME7_NO_CLAMP ? H * f->h : fmin(1, H * f->h);
        if (!(imp__u01(key, (uint32_t)k) < s)) break;
        /* and E *= kernel/(s q), q = kernel/H in the analog case */
        if (slip != ME1_AREA) E *= f->rho / s;
    }
    return R;
}

static void slips(void)
{
    /* ME1: H integrated over area too. Photons survive with min(1, H A) in place of H. */
    static const double radius[] = {.2, .5};
    for (int k = 0; k < 2; k++) {
        const struct furnace f = {8,          1,         radius[k],    .5,
                                  "kernel=1", "diffuse", "reflectance"};
        const double s = fmin(1, .5 * 2 * IMP_2PI * imp__sqr(radius[k]));
        const double truth = furnace_truth(.2, .5, 8);
        struct tap_stat planted = {0};
        char what[96];
        for (uint64_t i = 0; i < 100000; i++)
            tap_add(&planted, pseudo_code(ME1_AREA, imp__key(1, 0, i), &f, .2));
        snprintf(what, sizeof what, "ME1, radius %g: L, as predicted,", radius[k]);
        expect(true, &planted, s < 1 ? furnace_truth(.2, s, 8) : .2 * 8, what);
        snprintf(what, sizeof what, "ME1, radius %g: L", radius[k]);
        expect(false, &planted, truth, what);
        struct photons p = photons_open(ctx, furnace_make(&f), 3);
        struct photon_mean m = photons_mean(&p, 100000);
        expect(true, &m.L, truth, "without it: L");
        photons_close(&p);
    }

    /* ME2: R = R + Q w in place of R + (Q/N) w. N photons give N times the reading. */
    enum { N = 50 };
    const struct furnace grey = {8, 1, 1, .5, "kernel=1", "diffuse", "reflectance"};
    struct tap_stat no_n = {0}, with_n = {0};
    for (uint64_t i = 0; i < 2000; i++) {
        double R = 0;
        for (uint64_t k = 0; k < N; k++)
            R += pseudo_code(NO_SLIP, imp__key(2, i, k), &grey, .2);
        tap_add(&no_n, R);
        tap_add(&with_n, R / N);
    }
    const double right = furnace_truth(.2, .5, 8);
    expect(true, &no_n, N * right, "ME2: L, as predicted 50 times the truth,");
    expect(false, &no_n, right, "ME2: L");
    expect(true, &with_n, right, "without it: L");

    /* ME3: the adjoint photons are those on the right of Fig. 2, not on the left. What is
     * on the left begins at the lamp: with the power of the adjoint, Q = int w cos, it is
     * off by the ratio of the areas. Coaxial discs of radius .5 (lamp) and 1 (sensor) at
     * distance 1: R = pi A1 F12 = 1.1568931, and four times as much. */
    struct tap_stat left = {0}, from_right = {0};
    for (uint64_t i = 0; i < 100000; i++) {
        const struct imp_key key = imp__key(3, 0, i);
        for (int side = 0; side < 2; side++) { /* begin at the lamp; at the sensor */
            const double r = side ? 1 : .5, other = side ? .5 : 1, Q = IMP_PI * IMP_PI;
            const double u[2] = {imp__u01(key, 1), imp__u01(key, 2)};
            const imp_v3 d = imp__cosine_hemisphere(u);
            const double rho = r * sqrt(imp__u01(key, 3)), t = 1 / d[2];
            const double x = rho + t * d[0], y = t * d[1];
            tap_add(side ? &from_right : &left, Q * (x * x + y * y < other * other));
        }
    }
    expect(true, &from_right, 1.1568931, "photons from the sensor: R");
    expect(true, &left, 4 * 1.1568931, "ME3: R, as predicted four times the truth,");
    expect(false, &left, 1.1568931, "ME3: R");

    /* ME7: h = 3 at H = .6 without the clamp. Every photon survives, with E *= 1/h. */
    const struct furnace f = {6, 3, 1, .6, "kernel=1", "diffuse", "reflectance"};
    struct tap_stat planted = {0}, clamped = {0};
    for (uint64_t i = 0; i < 1000; i++) {
        tap_add(&planted, pseudo_code(ME7_NO_CLAMP, imp__key(7, 0, i), &f, .2));
        tap_add(&clamped, pseudo_code(NO_SLIP, imp__key(7, 0, i), &f, .2));
    }
    expect(true, &planted, furnace_truth(.2, 1. / 3, 6), "ME7: L, as predicted,");
    expect(false, &planted, furnace_truth(.2, .6, 6), "ME7: L");
    expect(true, &clamped, furnace_truth(.2, .6, 6), "without it: L");

    /* ME4: "a good density p", where p is the kernel's own and q is drawn: kernel/p in
     * place of kernel/q. A white floor under a white sky; q = (cos/pi + 1/4pi)/2 draws a
     * quarter of its directions below the horizon, and the rest has weight 1. */
    static const char floor[] =
        "<scene version='3.0.0'><integrator type='photons'><string name='weights' "
        "value='kernel=1,environment=1'/></integrator><sensor type='perspective'><float "
        "name='fov' value='1'/><transform name='to_world'><lookat origin='0,3,.1' "
        "target='0,0,0' up='0,0,1'/></transform><film type='hdrfilm'><integer "
        "name='width' value='1'/><integer name='height' value='1'/><rfilter "
        "type='box'/></film></sensor><emitter type='constant'/><shape "
        "type='rectangle'><transform name='to_world'><rotate x='1' angle='-90'/>"
        "</transform><bsdf type='diffuse'><float name='reflectance' value='1'/></bsdf>"
        "</shape></scene>";
    struct photons p = photons_open(ctx, test_scene_text(ctx, floor, IMP_MONO), 4);
    struct tap_stat q = {0}, wrong = {0};
    for (int64_t k = 0; k < 100000; k++) {
        const struct imp_arena_mark mark = imp__arena_mark(&p.arena);
        const struct imp_walk walk = photons_trace(&p, k);
        const struct imp_vertex *v = walk.first;
        const double kernel = v->d.wi[2] / IMP_PI;
        tap_add(&q, walk.L[0]);
        tap_add(&wrong, v->d.goes_on && v->next
                            ? v->next->e[0] * v->w[0] * v->d.pdf / kernel
                            : 0);
        imp__arena_rewind(&p.arena, mark);
    }
    expect(true, &q, 1, "a white floor under a white sky: L");
    expect(true, &wrong, .75, "ME4: L, as predicted .75,");
    expect(false, &wrong, 1, "ME4: L");

    /* ME5: photons of one wavelength, drawn uniformly from 470 nm: each increments X, Y, Z
     * by its radiance times the responses over p(lambda) = 1/470 nm, where it hits a
     * *luminaire*. As printed, where it hits a sensor element and without 1/p, the first
     * is 0 in every scene, and the second 470 times too dark. Box-shaped responses of one
     * unit below and above 595 nm: X and Y of an equal-energy sky are their widths. */
    struct tap_stat x = {0}, y = {0}, no_p = {0};
    static const double one = 1;
    static const struct imp_spectrum box[2] = {
        {.form = IMP_SPECTRUM_NUMBER, .n = 1, .value = &one, .lo = 360, .hi = 595},
        {.form = IMP_SPECTRUM_NUMBER, .n = 1, .value = &one, .lo = 595, .hi = 830}};
    const struct imp_wavelengths waves = {
        .lanes = 1, .lo = 360, .hi = 830, .n_channels = 2, .response = box};
    p.tracer.wavelengths = &waves;
    for (int64_t k = 0; k < 20000; k++) {
        const struct imp_arena_mark mark = imp__arena_mark(&p.arena);
        const struct imp_walk walk = photons_trace(&p, k);
        tap_add(&x, walk.L[0]);
        tap_add(&y, walk.L[1]);
        tap_add(&no_p, walk.L[0] / 470);
        imp__arena_rewind(&p.arena, mark);
    }
    expect(true, &x, 235, "one wavelength a photon: X");
    expect(true, &y, 235, "one wavelength a photon: Y");
    expect(true, &no_p, .5, "ME5, without 1/p: X, as predicted .5,");
    expect(false, &no_p, 235, "ME5, without 1/p: X");
    photons_close(&p);
}

int main(void)
{
    ctx = test_context(2);
    roulette();
    albedos();
    drawn_weights();
    refused();
    slips();
    checks();
    imp_context_destroy(ctx);
    return tap_done();
}
