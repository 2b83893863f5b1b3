/* SPDX-License-Identifier: Apache-2.0
 *
 * importon envmap: pictures of the sky from one projection to another. */
#include "shared/command.h"
#include "shared/picture_files.h"

static const char *const words[] = {"latlong", "equal_area", NULL};
static struct {
    int from, to, width, height;
} o = {.from = 0, .to = 1};

static const struct arg_option options[] = {
    {ARG_CHOICE, 0, "from", "PROJECTION",
     "of the picture: latlong (default) or equal_area", &o.from, 0, 0, words},
    {ARG_CHOICE, 0, "to", "PROJECTION", "of the output: equal_area (default) or latlong",
     &o.to, 0, 0, words},
    {ARG_INT, 0, "width", "N", "columns of the output (default: the picture's)", &o.width,
     2, 1 << 20, NULL},
    {ARG_INT, 0, "height", "N", "rows of the output (default: the picture's)", &o.height,
     2, 1 << 20, NULL},
    {0}};

static int run_envmap(int n, char **operand)
{
    const struct picture_options write = {.no_preview = 1};
    struct imp_film_info info = {.size = sizeof info};
    imp_film *in = NULL, *out = NULL;
    (void)n;
    if (!cli.out) return cli_error(EXIT_USAGE, "envmap: -o FILE is missing");
    int rc = cli_open();
    if (!rc) rc = picture_writable(cli.out, 0);
    if (!rc) rc = picture_read(operand[0], &in);
    if (rc) return rc;
    enum imp_status st = imp_film_get_info(in, &info);
    if (st == IMP_OK)
        st = imp_film_project(
            in, (enum imp_sky_projection)o.from, (enum imp_sky_projection)o.to,
            o.width ? o.width : info.width, o.height ? o.height : info.height, &out);
    const struct imp_run run = cli_run();
    if (st == IMP_OK) picture_stamp(out, &run);
    rc = st == IMP_OK ? picture_write(out, cli.out, &write) : cli_fail(st, operand[0]);
    imp_film_destroy(in);
    imp_film_destroy(out);
    return rc;
}

const struct command command_envmap = {
    {"envmap",
     "PICTURE",
     "project a picture of the sky anew, with its light kept",
     {options, options_file, options_general},
     1,
     1},
    run_envmap,
    0,
    0,
    REPLAYS_NEVER};
