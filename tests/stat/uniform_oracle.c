/* SPDX-License-Identifier: Apache-2.0
 *
 * Every material and every light against the oracle of uniform directions
 * (imp_check_options.sampling); a material whose density is not the one it draws with, and a
 * proxy in whose directions nothing lies, are caught. */
#include "imp_scene.h"
#include "imp_tap.h"
#include "kind/build.h"
#include "math/warp.h"

static imp_context *ctx;
static int more = 1; /* times as many samples, with the argument "long" */

#define VIEW                                                                             \
    "<scene version='3.0.0'><integrator type='%s'><integer name='max_depth' value='4'/>" \
    "%s</integrator><sensor type='perspective'><float name='fov' "                       \
    "value='26'/><transform "                                                            \
    "name='to_world'><lookat origin='0,2,6' target='0,.2,0' up='0,1,0'/></transform>"    \
    "<film type='hdrfilm'><integer name='width' value='8'/><integer name='height' "      \
    "value='8'/></film></sensor><shape type='rectangle'><transform name='to_world'>"     \
    "<rotate x='1' angle='-90'/><scale value='4'/><translate "                           \
    "y='-1'/></transform></shape>"
#define SKY "<emitter type='constant'><float name='radiance' value='.5'/></emitter>"
#define LAMP                                                                             \
    "<shape type='sphere'><point name='center' x='2' y='3' z='2'/><float name='radius' " \
    "value='1'/><emitter type='area'><float name='radiance' "                            \
    "value='4'/></emitter></shape>"

/* Rows of method `uniform` that fail, all others, and what they say. */
struct outcome {
    int failed, passed, noisy, bad_aims;
    double worst;
};
static struct outcome verify(const char *type, const char *inside, const char *rest,
                             int spp)
{
    char xml[4096];
    struct outcome o = {0, 0, 0, 0, 0};
    snprintf(xml, sizeof xml, VIEW "%s</scene>", type, inside, rest);
    imp_scene *s = test_scene_text(ctx, xml, IMP_MONO);
    imp_problem *p;
    struct imp_run run = IMP_RUN_INIT;
    struct imp_check_options options = IMP_CHECK_OPTIONS_INIT;
    const struct imp_check_row *rows;
    size_t n;
    options.sampling = 1;
    run.spp = spp * more;
    run.seed = 12;
    test_must(ctx, imp_problem_create(s, &p));
    test_must(ctx, imp_check(p, &options, &run, &rows, &n));
    for (size_t i = 0; i < n; i++) {
        if (strcmp(rows[i].method, "aim") == 0) o.bad_aims += rows[i].ok == 0;
        if (strcmp(rows[i].method, "uniform") != 0) continue;
        o.failed += rows[i].ok == 0;
        o.passed += rows[i].ok == 1;
        o.noisy += rows[i].ok < 0;
        if (rows[i].se > 0) o.worst = fmax(o.worst, rows[i].error);
    }
    imp_problem_destroy(p);
    imp_scene_destroy(s);
    return o;
}

static void expect(const struct outcome *o, const char *what)
{
    tap_ok(o->failed == 0 && o->passed == 2 && o->noisy == 0, "%s # largest z %.1f", what,
           o->worst);
}

/* A kind with what it must have. */
static void bsdf_xml(const struct imp_bsdf_ops *ops, char *xml, size_t size)
{
    char inner[1024] = "";
    for (int k = 0; k < ops->min_children; k++) strcat(inner, "<bsdf type='diffuse'/>");
    for (const struct imp_input_desc *d = ops->inputs; d && d->name; d++)
        if (d->flags & IMP_INPUT_BUMP)
            snprintf(
                inner + strlen(inner), sizeof inner - strlen(inner),
                "<texture type='bitmap'><string name='filename' value='%s'/></texture>",
                IMP_SCENES "/../tests/render/peer/files/grey.png");
        else if (d->flags & IMP_INPUT_VECTOR)
            snprintf(
                inner + strlen(inner), sizeof inner - strlen(inner),
                "<texture type='checkerboard' name='%s'><rgb name='color0' value='.6'/>"
                "<rgb name='color1' value='.4,.5,.9'/></texture>",
                d->name);
        else if (d->flags & IMP_INPUT_REQUIRED || strcmp(d->name, "alpha") == 0)
            snprintf(inner + strlen(inner), sizeof inner - strlen(inner),
                     "<float name='%s' value='%s'/>", d->name,
                     strcmp(d->name, "alpha") == 0 ? ".8" : ".4");
    /* Through a ball two lobes would have to be hit at once. */
    const bool through =
        strcmp(ops->name, "roughdielectric") == 0 || strcmp(ops->name, "hair") == 0;
    snprintf(xml, size, "<shape type='%s'><bsdf type='%s'>%s</bsdf></shape>" SKY LAMP,
             through ? "rectangle" : "sphere", ops->name, inner);
}

static void materials(void)
{
    for (int k = 0; imp__bsdf_kinds[k]; k++) {
        char xml[2048], what[96];
        /* Of a file: stat/measured and render/drawn_values compare directions. */
        if (strcmp(imp__bsdf_kinds[k]->name, "merl") == 0 ||
            strcmp(imp__bsdf_kinds[k]->name, "measured") == 0)
            continue;
        bsdf_xml(imp__bsdf_kinds[k], xml, sizeof xml);
        struct outcome o = verify("path", "", xml, 1500);
        snprintf(what, sizeof what, "material %s", imp__bsdf_kinds[k]->name);
        expect(&o, what);
    }
}

static void lights(void)
{
    static const char *const row[][2] = {
        {"area on a sphere", LAMP},
        {"area on a rectangle",
         "<shape type='rectangle'><transform name='to_world'><rotate x='1' angle='90'/>"
         "<translate y='3'/></transform><emitter type='area'/></shape>"},
        {"area on a disk",
         "<shape type='disk'><transform name='to_world'><rotate x='1' angle='90'/>"
         "<translate y='3'/></transform><emitter type='area'/></shape>"},
        {"area on a cylinder",
         "<shape type='cylinder'><point name='p0' x='-2' y='3' z='0'/><point name='p1' "
         "x='2' y='3' z='0'/><float name='radius' value='.8'/><emitter type='area'/>"
         "</shape>"},
        {"area on a cube",
         "<shape type='cube'><transform name='to_world'><rotate x='1' y='1' angle='30'/>"
         "<translate x='2' y='3'/></transform><emitter type='area'/></shape>"},
        {"beam",
         "<shape type='rectangle'><transform name='to_world'><rotate x='1' angle='90'/>"
         "<translate y='3'/></transform><emitter type='beam'><float name='exponent' "
         "value='4'/></emitter></shape>"},
        {"constant", SKY},
        {"point beside a lamp", LAMP "<emitter type='point'><point name='position' "
                                     "x='0' y='4' z='2'/></emitter>"}};
    static const char *const type[][2] = {
        {"path", ""},
        {"photons", ""},
        {"photons", "<string name='weights' value='kernel=1,emitters=1,environment=1,"
                    "uniform=1'/><integer name='split' value='1'/>"}};
    for (size_t k = 0; k < sizeof row / sizeof *row; k++)
        for (int t = 0; t < 3; t++) {
            char what[96], xml[2048];
            if (t > 0 && strncmp(row[k][0], "point", 5) == 0) continue;
            snprintf(xml, sizeof xml, "<shape type='sphere'/>%s", row[k][1]);
            struct outcome o = verify(type[t][0], type[t][1], xml, 1500);
            snprintf(what, sizeof what, "light %s, %s%s", row[k][0], type[t][0],
                     *type[t][1] ? ", mixed" : "");
            expect(&o, what);
        }
}

/* ---- Negative controls ----------------------------------------------------------- */

/* Draws with a cosine, and says that it draws uniformly. */
static bool crooked_sample(const struct imp_bsdf *b, const imp_spec *in,
                           const double u[3], struct imp_dirs *d)
{
    (void)b, (void)in;
    d->wi = imp__cosine_hemisphere(&u[1]);
    d->lobe = IMP_SMOOTH;
    return d->wo[2] > 0;
}
static void crooked_eval(const struct imp_bsdf *b, const imp_spec *in,
                         const struct imp_dirs *d, imp_spec *f)
{
    (void)b, (void)in;
    *f = imp__spec(d->wi[2] > 0 && d->wo[2] > 0 ? .5 * d->wi[2] * IMP_INV_PI : 0);
}
static double crooked_pdf(const struct imp_bsdf *b, const imp_spec *in,
                          const struct imp_dirs *d)
{
    (void)b, (void)in;
    return d->wi[2] > 0 && d->wo[2] > 0 ? .5 * IMP_INV_PI : 0;
}
static void crooked_eval_d(const struct imp_bsdf *b, const imp_spec *in,
                           const struct imp_dirs *d, imp_spec *df)
{
    (void)b, (void)in, (void)d, (void)df;
}
static const struct imp_input_desc none[] = {{0}};
static const struct imp_bsdf_ops crooked = {.size = sizeof crooked,
                                            .name = "crooked",
                                            .inputs = none,
                                            .sample = crooked_sample,
                                            .eval = crooked_eval,
                                            .pdf = crooked_pdf,
                                            .eval_d = crooked_eval_d};

int main(int argc, char **argv)
{
    if (argc > 1 && strcmp(argv[1], "long") == 0) more = 20;
    ctx = test_context(2);
    test_must(ctx, imp_register_bsdf(ctx, &crooked));
    materials();
    lights();
    const struct outcome wrong =
        verify("photons", "<string name='weights' value='kernel=1'/>",
               "<shape type='sphere'><bsdf type='crooked'/></shape>" SKY LAMP, 1500);
    tap_ok(wrong.failed > 0, "a wrong density is caught # z %.1f", wrong.worst);
    const struct outcome lost = verify(
        "path", "",
        LAMP "<shape type='sphere' name='proxy'><point name='center' x='-90' y='90' "
             "z='-60'/></shape>",
        500);
    tap_ok(lost.failed == 0 && lost.bad_aims == 1, "a proxy that nothing meets is told");
    imp_context_destroy(ctx);
    return tap_done();
}
