/* SPDX-License-Identifier: Apache-2.0
 *
 * Derivatives by what moves under lamps that are shapes and shine by a table (ies): the lamps' poses,
 * a block and the camera, imp_problem_reverse against central differences; a lamp that the camera sees
 * and a meter below one; the picture of a lamp that was moved against that of a file with the motion in
 * it. What is refused. */
#include "ies_table.h"
#include "moves_kit.h"
#include "moves_numbers.h"

#define TABLE  "moved_tables.ies"
#define LEFT   "moved_tables_left.ies"
#define DIRECT "<integrator type='direct'/>"
#define PATH   "<integrator type='path'><integer name='max_depth' value='3'/></integrator>"
#define SHINES(table)                                                                    \
    "<emitter type='ies'><string name='filename' value='" table                          \
    "'/><float name='scale' "                                                            \
    "value='1.5'/></emitter></shape>"
#define PLACE "<rotate x='1' angle='165'/><translate x='-.9' y='-.6' z='3'/></transform>"
#define LAMP(shape, size, table)                                                         \
    "<shape type='" shape "' id='it'><transform name='to_world'>" size PLACE SHINES(table)
#define DOWN                                                                             \
    "<emitter type='ies'><string name='filename' value='" TABLE                          \
    "'/><transform name='to_world'><rotate x='1' angle='190'/></transform></emitter>"    \
    "</shape>"
#define SQUARE LAMP("rectangle", "<scale x='.4' y='.25'/>", TABLE)
#define ROUND  LAMP("disk", "<scale value='.3'/>", TABLE)
#define BOX                                                                              \
    "<shape type='cube' id='it'><transform name='to_world'><scale x='.3' y='.2' "        \
    "z='.1'/>" PLACE DOWN
#define BALL(z)                                                                          \
    "<shape type='sphere' id='it'><point name='center' x='-.9' y='-.6' z='" z            \
    "'/><float name='radius' value='.2'/>" DOWN

static imp_scene *room(const char *rest)
{
    return room_build(ctx, &(struct room_parts){.rest = rest});
}

/* The picture of a lamp that was moved is that of a file with the motion in it. */
static void moved_test(void)
{
    static const double pose[6] = {.2, -.1, .15, 0, 0, .5};
    static float x[2][WIDTH * HEIGHT * 3];
    double worst = 0;
    for (int k = 0; k < 2; k++) {
        imp_scene *scene = room(
            k ? DIRECT SQUARE
              : DIRECT "<shape type='rectangle' id='it'><transform "
                       "name='to_world'><scale x='.4' "
                       "y='.25'/><rotate x='1' angle='165'/><rotate z='1' "
                       "angle='28.6478897565412'/><translate x='-.7' y='-.7' z='3.15'/>"
                       "</transform>" SHINES(TABLE));
        struct imp_run run = IMP_RUN_INIT;
        imp_film *film;
        size_t index;
        test_must(ctx, imp_scene_add_pose(scene, "it"));
        test_must(ctx, imp_scene_find_param(scene, "it.pose", &index));
        if (k) test_must(ctx, imp_scene_set_values(scene, index, 6, pose));
        run.spp = 16;
        test_must(ctx, imp_render(scene, &run, &film));
        memcpy(x[k], imp_film_mean(film), sizeof x[k]);
        imp_film_destroy(film);
        imp_scene_destroy(scene);
    }
    for (int k = 0; k < WIDTH * HEIGHT * 3; k++)
        worst = fmax(worst, fabs((double)x[0][k] - (double)x[1][k]));
    tap_ok(worst < 1e-4, "the picture of a lamp that has moved # off %.1e", worst);
}

int main(int argc, char **argv)
{
    const int more = tap_is_long(argc, argv) ? 16 : 1;
    static const struct number lamp[] = {{"it.pose", 0, .02},     {"it.pose", 2, .02},
                                         {"it.pose", 3, .02},     {"it.pose", 4, .02},
                                         {"it.pose", 5, .03},     {"block.pose", 0, .02},
                                         {"camera.pose", 5, .01}, {NULL, 0, 0}};
    static const struct number turns[] = {
        {"it.pose", 1, .02}, {"it.pose", 3, .02}, {"it.pose", 5, .03}, {NULL, 0, 0}};
    ctx = test_context(2);
    adjoint_make();
    table_write(TABLE, 0);
    table_write(LEFT, 300);
    moved_test();
    numbers_compare("rectangle", room(PATH SQUARE), 32 * more, 64 * more, .1, lamp);
    numbers_compare("disk", room(DIRECT ROUND), 32 * more, 64 * more, .1, turns);
    numbers_compare("box", room(DIRECT BOX), 64 * more, 64 * more, .15, turns);
    numbers_compare("ball", room(DIRECT BALL("3")), 64 * more, 64 * more, .2, turns);
    numbers_compare("a ball that is seen", room(DIRECT BALL("1.2")), 64 * more, 64 * more,
                    .2, turns);
    number_refused("a table that jumps",
                   room(DIRECT LAMP("rectangle", "<scale value='.3'/>", LEFT)), "it.pose",
                   "still has light");
    number_refused("a luminaire has no scale", room(DIRECT SQUARE), "it.scale", "light");
    remove(TABLE);
    remove(LEFT);
    imp_context_destroy(ctx);
    return tap_done();
}
