/* SPDX-License-Identifier: Apache-2.0
 *
 * importon: the command line of libimporton. Data goes to standard output or -o, talk to
 * standard error. */
#include "shared/command.h"
#include "shared/output.h"
#include "shared/part.h"
#include "shared/proof.h"
#include "shared/ranks.h"
#include "text/progress.h"

#include <errno.h>
#ifdef __GLIBC__
#include <malloc.h>
#endif
#include <signal.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static const struct command *const commands[] = {
    &command_render,   &command_gradient, &command_jacobian, &command_check,
    &command_selftest, &command_fit,      &command_compare,  &command_info,
    &command_bend,     &command_bench,    &command_elements, &command_envmap,
    &command_merge,    &command_report,   &command_read,     &command_verify,
    &command_view,     &command_record,   &command_whatif,   &command_plan,
    &command_measure,  &command_design};
#define N_COMMANDS (sizeof commands / sizeof *commands)

static void print_usage(FILE *to)
{
    fprintf(to, "usage: importon COMMAND [options] ...\n\n");
    for (size_t i = 0; i < N_COMMANDS; i++)
        fprintf(to, "  %-10s %s\n", commands[i]->args.command, commands[i]->args.summary);
    fprintf(to, "\n'importon help COMMAND' lists the options of one;"
                " 'man importon' explains them.\n");
}

const struct command *cli_command(const char *name)
{
    for (size_t i = 0; i < N_COMMANDS; i++)
        if (!strcmp(name, commands[i]->args.command)) return commands[i];
    return NULL;
}

static const struct command *find(const char *name)
{
    const char *names[N_COMMANDS + 1] = {0};
    const struct command *command = cli_command(name);
    if (command) return command;
    for (size_t i = 0; i < N_COMMANDS; i++) names[i] = commands[i]->args.command;
    const char *near = args_nearest(name, names);
    fprintf(stderr, "importon: unknown command '%s'", name);
    if (near) fprintf(stderr, "; did you mean '%s'?", near);
    fprintf(stderr, "\nTry 'importon help'.\n");
    return NULL;
}

/* Where standard output goes with -o FILE. */
static struct output redirected;

/* A full disk shows only when the last bytes are flushed. */
static int finish(int rc)
{
    errno = 0;
    if (fflush(stdout) != 0 || ferror(stdout)) {
        const char *name = redirected.file ? redirected.path : "standard output";
        const int code = errno ? errno : EIO;
        (void)output_close(&redirected, EXIT_RUN);
        /* the terminal is gone; files are written */
        if (!redirected.path && progress_interrupted() == SIGHUP) return rc;
        return cli_error(EXIT_RUN, "%s: %s", name, strerror(code));
    }
    /* An answer that is no, or was interrupted, is an answer too. */
    const int lost = rc == EXIT_USAGE || rc == EXIT_RUN;
    const int closed = output_close(&redirected, lost ? rc : 0);
    return closed ? closed : rc;
}

int cli_redirect(void)
{
    if (!cli.out || !strcmp(cli.out, "-")) return 0;
    const int rc = output_open(&redirected, cli.out, OUTPUT_ANSWER);
    if (rc == 0 && dup2(fileno(redirected.file), STDOUT_FILENO) < 0)
        return cli_error(EXIT_RUN, "%s: %s", cli.out, strerror(errno));
    /* The mark of an answer in a file (overwrite.c); one in JSON begins with its own. */
    if (rc == 0 && redirected.target && !cli.json)
        printf("# importon %s %s\n", imp_version(), cli.name);
    return rc;
}

int cli_run_command(int argc, char **argv)
{
    const struct command *command = find(argv[0]);
    int first, rc;
    if (!command) return EXIT_USAGE;
    cli.name = command->args.command;
    if (ranks_count() > 1 && !command->shared)
        return cli_error(EXIT_USAGE, "%s runs in one process, and mpirun started %d",
                         cli.name, ranks_count());
    cli.argc = argc;
    free(cli.argv); /* of merge, which runs another command */
    cli.argv = cli_alloc((size_t)argc + 1, sizeof *cli.argv);
    memcpy(cli.argv, argv, (size_t)argc * sizeof *argv); /* getopt reorders argv */
    /* --help needs no operands. */
    for (int i = 1; i < argc && strcmp(argv[i], "--"); i++)
        if (!strcmp(argv[i], "--help") || !strcmp(argv[i], "-h")) {
            args_help(&command->args, stdout);
            return EXIT_DONE;
        }
    for (size_t k = 0; k < cli.typed.n; k++) free((void *)(uintptr_t)cli.typed.item[k]);
    args_list_free(&cli.typed);
    rc = args_parse(&command->args, argc, argv, &first, &cli.typed);
    cli.n_operands = argc - first;
    cli.operand = argv + first;
    for (int i = first; rc == 0 && i < argc; i++) overwrite_protect(argv[i]);
    if (rc == 0 && cli.points == IMP_POINTS_WHOLE && strcmp(cli.name, "render"))
        rc = cli_error(EXIT_USAGE,
                       "--points whole is for pictures without standard errors: "
                       "'importon render' alone has it");
    if (rc == 0) rc = part_begin();
    if (rc == 0 && command->prints && !cli.verifies) rc = cli_redirect();
    if (rc == 0) {
        ranks_heard();
        progress_init(cli.quiet || !ranks_first() ? PROGRESS_NEVER
                                                  : (enum progress_mode)cli.progress);
        rc = command->run(argc - first, argv + first);
        progress_clear();
    }
    return rc;
}

/* A check or a fit makes hundreds of pictures of the same size, and a large scene is read through
 * arrays that are released before the next ones are made. What one frees stays with the process for the
 * next; else glibc gives it back and takes it again, and the page faults, with pages that the system
 * clears, cost 4 % of a check and 6 to 9 % of the reading of a room of 100,000 polygons. */
static void memory_keep(void)
{
#ifdef __GLIBC__
    mallopt(M_TRIM_THRESHOLD, 4 << 20);
    mallopt(M_MMAP_THRESHOLD, 32 << 20); /* the most that it takes */
#endif
}

int main(int argc, char **argv)
{
    const char *name = argc > 1 ? argv[1] : "";
    const struct command *command;
    int rc;

    memory_keep();
    ranks_begin();
    if (!*name) {
        print_usage(stderr);
        return EXIT_USAGE;
    }
    if (!strcmp(name, "--version") || !strcmp(name, "-V")) {
        printf("importon %s\n", imp_version());
        return finish(EXIT_DONE);
    }
    if (!strcmp(name, "--help") || !strcmp(name, "-h") || !strcmp(name, "help")) {
        if (argc > 2 && !(command = find(argv[2]))) return EXIT_USAGE;
        rc = EXIT_DONE;
        if (argc > 3) rc = args_help_option(&command->args, argv[3], stdout);
        else if (argc > 2) args_help(&command->args, stdout);
        else print_usage(stdout);
        return finish(rc);
    }
    rc = cli_run_command(argc - 1, argv + 1);
    rc = manifest_end(finish(rc == EXIT_STOP ? EXIT_DONE : rc));
    cli_close();
    return ranks_close(rc);
}
