/* SPDX-License-Identifier: Apache-2.0
 *
 * Cylinders under a to_world that scales unevenly or shears, against a mesh of the same body
 * (1024 facets around, normals and uv at their edges) under the same to_world: as textured
 * things, with roughness that has directions, and as lamps. The picture of a circular one
 * is another. */
#include "imp_scene.h"
#include "imp_tap.h"
#include <math.h>
#include <unistd.h>

#define FACETS 1024
#define SPP    256

static imp_context *ctx;
static char file[] = "/tmp/imp_oval_XXXXXX.obj";

static void mesh_write(void)
{
    const int fd = mkstemps(file, 4);
    FILE *f = fd >= 0 ? fdopen(fd, "w") : NULL;
    if (!f) exit(99);
    for (int i = 0; i <= FACETS; i++) {
        const double phi = 6.283185307179586 * i / FACETS, x = cos(phi), y = sin(phi);
        for (int v = 0; v < 2; v++)
            fprintf(f, "v %.9g %.9g %d\nvn %.9g %.9g 0\nvt %.9g %d\n", x, y, v, x, y,
                    (double)i / FACETS, 1 - v); /* flipped when read */
    }
    for (int i = 0; i < FACETS; i++) {
        const int a = 2 * i + 1;
        fprintf(f, "f %d/%d/%d %d/%d/%d %d/%d/%d\n", a, a, a, a + 2, a + 2, a + 2, a + 3,
                a + 3, a + 3);
        fprintf(f, "f %d/%d/%d %d/%d/%d %d/%d/%d\n", a, a, a, a + 3, a + 3, a + 3, a + 1,
                a + 1, a + 1);
    }
    fclose(f);
}

#define CHECKS(name)                                                                     \
    "<texture type='checkerboard' name='" name "'><rgb name='color0' "                   \
    "value='.1,.2,.3'/><rgb name='color1' value='.9,.7,.4'/><transform "                 \
    "name='to_uv'><scale x='6' y='4'/></transform></texture>"
#define POINT                                                                            \
    "<emitter type='point'><point name='position' value='3,-4,5'/><rgb "                 \
    "name='intensity' value='30,40,50'/></emitter>"

static const struct {
    const char *what, *body, *rest;
} looks[3] = {
    {"textured",
     "<bsdf type='twosided'><bsdf type='diffuse'>" CHECKS("reflectance") "</bsdf></bsdf>",
     "<emitter type='constant'/>" POINT},
    {"rough along one axis",
     "<bsdf type='twosided'><bsdf type='roughconductor'><float name='alpha_u' "
     "value='.15'/><float name='alpha_v' value='.5'/></bsdf></bsdf>",
     POINT},
    {"a lamp", "<emitter type='area'>" CHECKS("radiance") "</emitter>", ""},
};
static const char *const places[3] = {
    "<scale x='1.4' y='.4' z='1.3'/>",
    "<scale x='.3' y='1.2' z='1.3'/>",
    "<scale x='1.4' y='.4' z='1.3'/><matrix value='1 .5 .3 0 0 1 .4 0 0 .2 1 0 0 0 0 "
    "1'/>",
};

static imp_film *picture(const char *type, const char *place, int look, uint64_t seed)
{
    static char xml[4096];
    struct imp_run run = IMP_RUN_INIT;
    imp_film *film;
    snprintf(
        xml, sizeof xml,
        "<scene version='3.0.0'><integrator type='path'><integer name='max_depth' "
        "value='3'/></integrator><sensor type='perspective'><float name='fov' "
        "value='45'/><transform name='to_world'><lookat origin='1,-6,3' target='0,0,.4' "
        "up='0,0,1'/></transform><film type='hdrfilm'><integer name='width' "
        "value='24'/><integer name='height' value='24'/><rfilter "
        "type='box'/></film></sensor>%s<shape type='rectangle'><transform "
        "name='to_world'><scale value='4'/><translate z='-1'/></transform><bsdf "
        "type='diffuse'/></shape><shape type='%s'>%s%s%s<transform "
        "name='to_world'>%s<rotate x='1' angle='40'/><rotate y='1' "
        "angle='35'/></transform>%s</shape></scene>",
        looks[look].rest, type, *type == 'o' ? "<string name='filename' value='" : "",
        *type == 'o' ? file : "", *type == 'o' ? "'/>" : "", place, looks[look].body);
    imp_scene *scene = test_scene_text(ctx, xml, IMP_RGB);
    run.spp = SPP;
    run.seed = seed;
    test_must(ctx, imp_render(scene, &run, &film));
    imp_scene_destroy(scene);
    return film;
}

static struct imp_compare_result compare(imp_film *a, imp_film *b)
{
    struct imp_compare_options o = IMP_COMPARE_OPTIONS_INIT;
    struct imp_compare_result r = {.size = sizeof r};
    o.n_test = o.n_reference = SPP;
    test_must(ctx, imp_compare(ctx, a, b, &o, &r));
    return r;
}

int main(void)
{
    ctx = test_context(0);
    mesh_write();
    for (int look = 0; look < 3; look++)
        for (int k = 0; k < 3; k++) {
            imp_film *own = picture("cylinder", places[k], look, 1),
                     *mesh = picture("obj", places[k], look, 2);
            const struct imp_compare_result r = compare(own, mesh);
            tap_ok(r.has_z && r.agree && r.mean_z < 4 && r.over2 < .07,
                   "%s, placement %d # mean %.5g, of the mesh %.5g, z %.2f; %.1f %% of "
                   "pixels beyond 2",
                   looks[look].what, k, r.mean_a, r.mean_b, r.mean_z, 100 * r.over2);
            if (k == 0) {
                imp_film *round =
                    picture("cylinder", "<scale x='1.4' y='1.4' z='1.3'/>", look, 3);
                const struct imp_compare_result other = compare(round, mesh);
                tap_ok(!other.agree && other.mean_z > 10,
                       "a circular one differs # z %.1f", other.mean_z);
                imp_film_destroy(round);
            }
            imp_film_destroy(own);
            imp_film_destroy(mesh);
        }
    unlink(file);
    imp_context_destroy(ctx);
    return tap_done();
}
