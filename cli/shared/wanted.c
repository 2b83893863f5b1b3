/* SPDX-License-Identifier: Apache-2.0
 *
 * --until: options, refusals and the closing line of a render that stops at a relative error. */
#include "wanted.h"
#include "command.h"
#include "ranks.h"

int until_refused(void)
{
    if (cli.part)
        return cli_error(EXIT_USAGE,
                         "--until: how many samples there will be is not known before, "
                         "so there are no parts of it");
    if (cli.time_s > 0 && ranks_count() > 1)
        return cli_error(EXIT_USAGE, "--until with --time: not under mpirun, whose "
                                     "processes have clocks of their own");
    return 0;
}

struct imp_until_options until_options(double relative, struct imp_run *run)
{
    struct imp_until_options until = IMP_UNTIL_OPTIONS_INIT;
    until.relative = relative;
    until.most_spp = run->spp;
    run->spp = 0;
    return until;
}

void until_say(const char *what, const struct imp_until_end *end)
{
    cli_say("%s: within %.3g of itself in 95 of 100 cases%s (%lld sample%s, %d look%s)",
            what, end->relative,
            end->reached ? "" : ", which is more than --until allows",
            (long long)end->spp, plural(end->spp), end->looks, plural(end->looks));
}

void until_json(struct json *j, double relative, const struct imp_until_end *end)
{
    json_object(j, "until");
    json_number(j, "wanted", relative);
    json_number(j, "error", end->relative);
    json_bool(j, "reached", end->reached);
    json_integer(j, "looks", end->looks);
    json_end_object(j);
}
