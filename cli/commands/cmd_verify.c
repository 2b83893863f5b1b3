/* SPDX-License-Identifier: Apache-2.0
 *
 * importon verify: does a result agree with its manifest? Its files are compared with their
 * hashes, and the command that made it is run again, all of it or a random part. */
#include "shared/ranks.h"
#include "shared/replay.h"

#include <fcntl.h>
#include <stdlib.h>
#include <string.h>
#include <sys/random.h>
#include <unistd.h>

static struct {
    double fraction;
    uint64_t seed;
} o = {.fraction = 1};

static const struct arg_option options[] = {
    {ARG_NUMBER, 0, "fraction", "F",
     "compute this part of the sums again, drawn at random (default 1: all)", &o.fraction,
     1e-6, 1, NULL},
    {ARG_SEED, 0, "seed", "N", "seed of the draw (default: from the system)", &o.seed, 0,
     0, NULL},
    {0}};

static int verdict(const char *path, const struct imp_manifest_info *info, int rc)
{
    const char *why = info->refuted;
    if (!why && rc) return rc; /* it was printed */
    if (!why && info->n_missing) why = "the command did not read or make all that it did";
    if (cli.json) {
        struct json j = cli_json();
        json_bool(&j, "verified", !why);
        json_text(&j, "refuted", why);
        json_integer(&j, "inputs", info->n_inputs);
        json_integer(&j, "outputs", info->n_outputs);
        json_integer(&j, "sums", (int64_t)info->n_sums);
        json_integer(&j, "sums_verified",
                     (int64_t)(o.fraction < 1 ? info->n_verified : info->n_sums));
        json_seed(&j, "seed", o.seed);
        cli_json_end(&j);
    } else if (why) {
        char *text = cli_plain(why); /* it names files of the manifest's */
        printf("%s: refuted: %s\n", path, text);
        free(text);
    } else if (o.fraction < 1) {
        printf("%s: verified: %d input file%s, %d output file%s, %llu of %llu sum%s "
               "computed "
               "again, and what they make\n",
               path, info->n_inputs, plural(info->n_inputs), info->n_outputs,
               plural(info->n_outputs), (unsigned long long)info->n_verified,
               (unsigned long long)info->n_sums, plural((long long)info->n_sums));
    } else {
        printf("%s: verified: %d input file%s, %d output file%s, and the result, all "
               "computed again\n",
               path, info->n_inputs, plural(info->n_inputs), info->n_outputs,
               plural(info->n_outputs));
    }
    return why ? EXIT_NO : EXIT_DONE;
}

/* Its answers are not printed a second time. */
static int run_silently(int n, char **words)
{
    fflush(stdout);
    const int kept = fcntl(STDOUT_FILENO, F_DUPFD_CLOEXEC, 3),
              nothing = open("/dev/null", O_WRONLY | O_CLOEXEC), json = cli.json;
    dup2(nothing, STDOUT_FILENO);
    close(nothing);
    const int quiet = cli.quiet;
    cli.verifies = cli.quiet = 1;
    cli.out = NULL;
    const int rc = cli_run_command(n, words);
    fflush(stdout);
    dup2(kept, STDOUT_FILENO);
    close(kept);
    cli.json = json;
    cli.quiet = quiet;
    return rc;
}

static int run_verify(int n, char **operand)
{
    struct imp_manifest_info info = {.size = sizeof info};
    const char *path = operand[0];
    (void)n;
    if (ranks_count() > 1 && o.fraction < 1)
        return cli_error(EXIT_USAGE,
                         "verify: a part is verified by one process; mpirun "
                         "started %d",
                         ranks_count());
    if (o.fraction < 1 && !o.seed && getrandom(&o.seed, sizeof o.seed, 0) < 0)
        return cli_error(EXIT_RUN, "verify: the system has no random numbers: --seed N");
    int rc = cli_open();
    if (rc) return rc;
    enum imp_status st =
        imp_manifest_read(cli.context, path, o.fraction, o.seed, &cli.manifest);
    if (st == IMP_OK) st = imp_manifest_get_info(cli.manifest, &info);
    if (st != IMP_OK) return cli_fail(st, NULL);
    char **words = NULL;
    int n_words = 0;
    rc = replay_words(path, REPLAYS_MANIFEST, info.command, &n_words, &words);
    if (rc) return rc;
    char *const memory = words[0]; /* getopt reorders the words */
    if (o.fraction < 1 && info.n_sums == 0) {
        cli_say("%s: has no sums of parts: all is computed again", path);
        o.fraction = 1;
    }
    cli.carried = path;
    if (!info.refuted) rc = run_silently(n_words, words);
    free(memory);
    free(words);
    imp_manifest_get_info(cli.manifest, &info);
    if (!rc && !info.refuted && o.fraction < 1 && info.n_verified == 0)
        return cli_error(EXIT_USAGE,
                         "verify: %g of %llu sums is none: a larger --fraction",
                         o.fraction, (unsigned long long)info.n_sums);
    return verdict(path, &info, rc);
}

const struct command command_verify = {
    {"verify",
     "MANIFEST",
     "compute a result again, or a part of it, and compare its bits",
     {options, options_file, options_general},
     1,
     1},
    run_verify,
    1,
    1,
    REPLAYS_NEVER};
