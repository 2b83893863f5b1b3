/* SPDX-License-Identifier: Apache-2.0
 *
 * importon view: a page on this machine that shows a render, a fit or bent rays as they
 * run. */
#include "bend/cmd_bend.h"
#include "fit/fit_options.h"
#include "shared/problem_options.h"
#include "view.h"

struct view_options view_options;

static const struct arg_option options[] = {
    {ARG_INT, 0, "port", "N", "listen on this port of 127.0.0.1 (default: any)",
     &view_options.port, 1, 65535, NULL},
    {ARG_TEXT, 0, "checkpoint", "FILE", "where the state of a fit is saved",
     &view_options.checkpoint, 0, 0, NULL},
    {ARG_TEXT, 0, "truth", "FILE", "bent rays: the true field, to compare",
     &bend_truth_path, 0, 0, NULL},
    {0}};

static int run(int n, char **operand)
{
    (void)n;
    if (view_is_bend(operand[0])) return view_bend(operand[0]);
    const int rc = cli_load(operand[0]);
    if (rc) return rc;
    return problem_options.targets.n ? view_fit() : view_scene();
}

const struct command command_view = {
    {"view",
     "SCENE",
     "look on in a browser: a render, a fit (--target) or bent rays",
     {options, options_search, options_targets, options_params, options_run,
      options_limits, options_guide, options_scene, options_file_or_folder,
      options_general},
     1,
     1},
    run,
    0,
    0,
    REPLAYS_NEVER};
