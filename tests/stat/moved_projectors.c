/* SPDX-License-Identifier: Apache-2.0
 *
 * Derivatives by the place, direction and field of view of a projector, whose picture slides over what it
 * lights and ends at a border: what a meter reads of a picture that it holds in part, in closed form; a
 * room in the light of a picture against differences. A spot with a texture. What is refused. */
#include "mean_gradient.h"
#include "moves_kit.h"
#include "moves_numbers.h"
#include <unistd.h>

/* ---- Closed form ---------------------------------------------------------------------------------- */

/* A picture of one irradiance I, thrown straight down from the height h at (x, 0), is a square of the
 * half side t h with the irradiance pi I/h^2. The meter, from -1 to 1, holds the part w = 1 - x + t h of
 * it along x: it reads  pi I/(4 h^2) 2 t h w. */
static void closed_test(void)
{
    const double h = 1.5, x = .8, t = tan(20 * IMP_PI / 180), w = 1 - x + t * h,
                 lit = IMP_PI * 3 * 2 * t / (4 * h);
    struct tap_stat g[3] = {{0}}, axis[3] = {{0}}, view[1] = {{0}};
    imp_scene *scene = test_scene_text(
        ctx,
        "<scene version='3.0.0'><integrator type='direct'/><emitter type='projector' "
        "id='lamp'><rgb name='irradiance' value='3'/><float name='fov' value='40'/>"
        "<transform name='to_world'><lookat origin='.8,0,1.5' target='.8,0,0' "
        "up='0,1,0'/></transform></emitter><shape type='rectangle'><sensor "
        "type='irradiancemeter'><film type='hdrfilm'><integer name='width' value='16'/>"
        "<integer name='height' value='16'/><rfilter type='box'/></film></sensor>"
        "</shape></scene>",
        IMP_MONO);
    test_must(ctx, imp_scene_add_geometry(scene, "lamp.position"));
    test_must(ctx, imp_scene_add_geometry(scene, "lamp.direction"));
    test_must(ctx, imp_scene_add_geometry(scene, "lamp.x_fov"));
    mean_gradient(ctx, scene, "lamp.x_fov", 64, 16, view);
    mean_gradient(ctx, scene, "lamp.position", 64, 16, g);
    mean_gradient(ctx, scene, "lamp.direction", 64, 16, axis);
    tap_z(&g[0], -lit, 3e-3 * lit, "a picture that slides over a meter");
    tap_z(&g[1], 0, 3e-3 * lit, "and along it");
    tap_z(&g[2], lit * (t - w / h), 3e-3 * lit, "a picture that is thrown from higher");
    /* Turned by a towards +x, the ray of the screen's u along x meets the plane at the meter's border,
     * b = (1 - x)/h from below it, where u = (b cos a - sin a)/(cos a + b sin a); what is sent up to
     * there is  pi I (u + t) 2 t. */
    double u[2];
    for (int s = 0; s < 2; s++) {
        const double a = s ? 1e-4 : -1e-4, b = (1 - x) / h;
        u[s] = (b * cos(a) - sin(a)) / (cos(a) + b * sin(a));
    }
    const double sum = (u[1] - u[0]) / 2e-4;
    tap_z(&axis[0], IMP_PI * 3 * 2 * t / 4 * sum, 3e-3 * lit, "a picture that turns");
    /* Wider by a degree, t grows by (1 + t^2)/2 pi/180. */
    tap_z(&view[0], lit / t * (w + t * h) * (1 + t * t) / 2 * IMP_PI / 180, 3e-4 * lit,
          "a picture that grows");
    imp_scene_destroy(scene);
}

/* ---- Differences ------------------------------------------------------------------------------------ */

static void picture_write(void)
{
    FILE *f = fopen("picture.pfm", "wb");
    if (!f) exit(99);
    fprintf(f, "PF\n6 4\n-1\n");
    for (int i = 0; i < 4; i++)
        for (int j = 0; j < 6; j++)
            for (int c = 0; c < 3; c++) {
                const float v =
                    (float)(.6 + .5 * cos(1.9 * i + c) * sin(1.3 * j + .7 * c));
                fwrite(&v, sizeof v, 1, f);
            }
    fclose(f);
}

static imp_scene *room(const char *integrator, const char *light)
{
    char xml[8192];
    snprintf(xml, sizeof xml,
             "<scene version='3.0.0'>%s%s<bsdf type='diffuse' id='grey'><rgb "
             "name='reflectance' value='.6,.5,.4'/></bsdf><sensor type='perspective' "
             "id='camera'><float name='fov' value='50'/><transform name='to_world'>"
             "<lookat origin='.4,-5.5,2.6' target='.1,0,.5' up='0,0,1'/></transform>"
             "<film type='hdrfilm'><integer name='width' value='24'/><integer "
             "name='height' value='16'/><rfilter type='box'/></film></sensor>"
             "<shape type='rectangle' id='floor'><transform name='to_world'><scale "
             "value='3'/></transform><ref id='grey'/></shape><shape type='rectangle'>"
             "<transform name='to_world'><scale value='3'/><rotate x='1' angle='90'/>"
             "<translate y='2' z='1.5'/></transform><ref id='grey'/></shape>"
             "<shape type='cube' id='block'><transform name='to_world'><scale x='.5' "
             "y='.4' z='.4'/><rotate z='1' angle='25'/><translate x='-.2' y='.3' "
             "z='.6'/></transform><ref id='grey'/></shape></scene>",
             integrator, light);
    return test_scene_text(ctx, xml, IMP_RGB);
}

#define DIRECT "<integrator type='direct'/>"
#define PATH   "<integrator type='path'><integer name='max_depth' value='4'/></integrator>"
#define PLACE                                                                            \
    "<transform name='to_world'><lookat origin='1.5,-3,3.5' target='.2,.2,.3' "          \
    "up='0,0,1'/></transform></emitter>"
#define PROJECTOR                                                                        \
    "<emitter type='projector' id='lamp'><float name='scale' value='3'/><float "         \
    "name='fov' value='30'/><texture type='bitmap' name='irradiance'><string "           \
    "name='filename' value='picture.pfm'/><boolean name='raw' "                          \
    "value='true'/></texture>" PLACE
#define NEAREST                                                                          \
    "<emitter type='projector' id='lamp'><texture type='bitmap' name='irradiance'>"      \
    "<string name='filename' value='picture.pfm'/><string name='filter_type' "           \
    "value='nearest'/></texture>" PLACE
#define SPOT                                                                             \
    "<emitter type='spot' id='lamp'><float name='intensity' value='30'/><float "         \
    "name='cutoff_angle' value='25'/><texture type='bitmap' name='texture'><string "     \
    "name='filename' value='picture.pfm'/><boolean name='raw' "                          \
    "value='true'/></texture>" PLACE

int main(int argc, char **argv)
{
    const int more = tap_is_long(argc, argv) ? 8 : 1;
    static const struct number all[] = {{"lamp.position", 0, .02},
                                        {"lamp.position", 2, .02},
                                        {"lamp.direction", 0, .01},
                                        {"lamp.direction", 2, .01},
                                        {"lamp.x_fov", 0, .5},
                                        {"block.pose", 0, .02},
                                        {NULL, 0, 0}},
                               world[] = {{"lamp.to_world", 3, .02},
                                          {"lamp.x_fov", 0, .5},
                                          {NULL, 0, 0}},
                               some[] = {{"lamp.position", 1, .02},
                                         {"lamp.direction", 0, .01},
                                         {NULL, 0, 0}};
    char folder[] = "moved_projectors_XXXXXX";
    ctx = test_context(2);
    adjoint_make();
    if (!mkdtemp(folder) || chdir(folder) != 0) exit(99);
    picture_write();
    closed_test();
    numbers_compare("a projector", room(DIRECT, PROJECTOR), 32 * more, 64 * more, .06,
                    all);
    numbers_compare("by its matrix", room(PATH, PROJECTOR), 32 * more, 64 * more, .06,
                    world);
    numbers_compare("a spot with a picture", room(DIRECT, SPOT), 32 * more, 64 * more,
                    .06, some);
    number_refused("a spot, whose cone is in its inputs", room(DIRECT, SPOT),
                   "lamp.x_fov", "no projector");
    number_refused("a picture that jumps", room(DIRECT, NEAREST), "lamp.position",
                   "values jump");
    if (remove("picture.pfm") != 0 || chdir("..") != 0 || rmdir(folder) != 0) exit(99);
    imp_context_destroy(ctx);
    return tap_done();
}
