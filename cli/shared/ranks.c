/* SPDX-License-Identifier: Apache-2.0
 *
 * The ranks of MPI. The library for it is opened when the environment shows that mpirun
 * started several processes. Ranks other than 0 work with standard output closed; their
 * warnings and errors are sent to rank 0 in the end, which prints those that are not its
 * own too. */
#include "ranks.h"
#include "command.h"
#include "text/progress.h"

#include <dlfcn.h>
#include <fcntl.h>
#include <importon/mpi.h>
#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

/* MPI's SIGTERM to ranks that it ends is followed by SIGKILL, after a second with the
 * defaults of Open MPI. */
#define PATIENCE_S 0.5

static struct {
    const char *name; /* of the MPI library */
    int rank, ranks;
    void *library;
    imp_mpi *mpi;
    struct imp_team team;
    double asked_s; /* when a signal to end came; 0: none did */
    int failed;     /* an error was printed here */
    bool unable;    /* to meet the others */
    int heard;      /* what standard error is to be again */
    char said[2048];
} r = {.ranks = 1};

static int number(const char *name, int otherwise)
{
    const char *text = getenv(name);
    return text && *text ? atoi(text) : otherwise;
}

void ranks_begin(void)
{
    if (number("OMPI_COMM_WORLD_SIZE", 1) > 1) {
        r.name = "openmpi";
        r.ranks = number("OMPI_COMM_WORLD_SIZE", 1);
        r.rank = number("OMPI_COMM_WORLD_RANK", 0);
    } else if (number("PMI_SIZE", 1) > 1) {
        r.name = "mpich";
        r.ranks = number("PMI_SIZE", 1);
        r.rank = number("PMI_RANK", 0);
    }
    if (r.ranks == 1 && getenv("PMIX_RANK")) { /* srun --mpi=pmix */
        r.ranks = number("SLURM_STEP_NUM_TASKS", 1);
        r.rank = number("PMIX_RANK", 0);
        r.name = "openmpi";
    }
    if (r.rank == 0) return;
    const int nothing = open("/dev/null", O_WRONLY | O_CLOEXEC);
    r.heard = fcntl(STDERR_FILENO, F_DUPFD_CLOEXEC, 3);
    dup2(nothing, STDOUT_FILENO);
    dup2(nothing, STDERR_FILENO);
    close(nothing);
}
void ranks_heard(void)
{
    if (r.heard < 3) return;
    dup2(r.heard, STDERR_FILENO);
    close(r.heard);
    r.heard = 0;
}
int ranks_count(void) { return r.ranks; }
bool ranks_first(void) { return r.rank == 0; }
bool ranks_reads(void) { return r.rank == 0 || cli.mpi_files != 0; }

/* A signal that ends everything: others may be gone already. Ctrl-C waits for them. */
static int give_up(void *payload)
{
    (void)payload;
    if (progress_interrupted() != SIGTERM) return 0;
    if (r.asked_s == 0) r.asked_s = cli_now();
    return cli_now() - r.asked_s > PATIENCE_S;
}

static int cannot(const char *why)
{
    /* Before ranks have met, each speaks for itself. */
    ranks_heard();
    fprintf(stderr, "importon: rank %d: %s\n", r.rank, why);
    r.unable = true;
    return EXIT_RUN;
}

static void *function(const char *name)
{
    return r.library ? dlsym(r.library, name) : NULL;
}
#define FUNCTION(name) ((__typeof__(&name))function(#name))

int ranks_open(imp_context *context)
{
    char file[64], text[512];
    struct imp_mpi_options o = IMP_MPI_OPTIONS_INIT;
    if (r.ranks == 1) return 0;
    if (cli.part)
        return cli_error(EXIT_USAGE,
                         "%s: --part is for one process, and mpirun started %d", cli.name,
                         r.ranks);
    if (!r.mpi) {
        snprintf(file, sizeof file, "libimporton-%s.so.0", r.name);
        /* Global: plug-ins of Open MPI search for its symbols there. */
        r.library = dlopen(file, RTLD_NOW | RTLD_GLOBAL);
        const __typeof__(&imp_mpi_open) open = FUNCTION(imp_mpi_open);
        if (!open) {
            snprintf(text, sizeof text,
                     "mpirun started %d processes, but %s cannot be used: %s", r.ranks,
                     file, r.library ? "it is of another version" : dlerror());
            return cannot(text);
        }
        o.give_up = give_up;
        r.team = (struct imp_team)IMP_TEAM_INIT;
        const enum imp_status st = open(&o, &r.mpi, &r.team);
        if (st != IMP_OK) {
            snprintf(text, sizeof text,
                     "the processes of mpirun cannot work together: %s",
                     imp_status_text(st));
            return cannot(text);
        }
        r.team.broadcast = cli.mpi_files == 0;
    }
    const enum imp_status st = imp_context_set_team(context, &r.team);
    return st == IMP_OK ? 0 : cli_fail(st, NULL);
}

void ranks_leave(void)
{
    if (r.ranks > 1) (void)!imp_context_set_team(cli.context, NULL);
}

struct bytes {
    char *data;
    size_t n;
    int failed;
};
static void bytes_receive(void *receiver, int rank, const void *message, size_t n)
{
    struct bytes *b = receiver;
    if (rank != 0) return;
    b->data = cli_alloc(n + 1, 1);
    memcpy(b->data, message, n);
    b->n = n;
}

int ranks_broadcast(char **bytes, size_t *n)
{
    struct bytes b = {NULL, 0, 0};
    if (r.ranks == 1) return 0;
    const bool first = r.rank == 0;
    if (r.team.gather(first ? *bytes : NULL, first ? *n : 0, bytes_receive, &b,
                      r.team.payload) != IMP_OK)
        return cli_fail(IMP_E_IO, NULL);
    free(*bytes);
    *bytes = b.data;
    *n = b.n;
    return 0;
}

double ranks_same(double number)
{
    char *bytes = NULL;
    size_t n = sizeof number;
    if (r.ranks == 1) return number;
    if (r.rank == 0) {
        bytes = cli_alloc(1, n);
        memcpy(bytes, &number, n);
    }
    /* A failure shows at the next call of the library. */
    if (ranks_broadcast(&bytes, &n) == 0 && n == sizeof number) memcpy(&number, bytes, n);
    free(bytes);
    return number;
}

void ranks_remember(bool error, const char *text)
{
    const size_t used = strlen(r.said);
    if (r.ranks == 1) return;
    r.failed |= error;
    /* A line of 'E' or 'W', as printed; the first that do not fit are the last. */
    if (used + strlen(text) + 3 < sizeof r.said)
        snprintf(r.said + used, sizeof r.said - used, "%c%s\n", error ? 'E' : 'W', text);
}

int ranks_ended(const char **text)
{
    static char reason[1200];
    int code = 0;
    const char *all = r.mpi ? FUNCTION(imp_mpi_ended)(r.mpi, &code) : "";
    if (!*all) return 0;
    /* "rank 1: " and lines as remembered there: its first error. */
    const char *line = strstr(all, ": ");
    const int who = line ? (int)(line + 2 - all) : 0;
    for (line = all + who; *line == 'W' && strchr(line, '\n');)
        line = strchr(line, '\n') + 1;
    if (*line == 'E')
        snprintf(reason, sizeof reason, "%.*s%.*s", who, all,
                 (int)strcspn(line + 1, "\n"), line + 1);
    else if (strchr(all, '\n'))
        snprintf(reason, sizeof reason, "%.*sit has ended before the others", who, all);
    else snprintf(reason, sizeof reason, "%s", all);
    *text = reason;
    return code ? code : EXIT_RUN;
}

/* Prints a message of another rank that rank 0 has not printed. Where rank 0 has an error
 * too, it is the same one. */
static void other_said(int rank, const char *text, void *payload)
{
    (void)payload;
    if (rank == 0) return;
    for (const char *line = text, *end; (end = strchr(line, '\n')); line = end + 1) {
        char one[1024];
        const size_t n = (size_t)(end - line);
        if (n == 0 || n >= sizeof one) continue;
        memcpy(one, line, n);
        one[n] = 0;
        const bool error = one[0] == 'E';
        const char *known = strstr(r.said, one);
        if ((known && known[n] == '\n') || (error && r.failed)) continue;
        ranks_remember(error, one + 1);
        if (error || !cli.quiet)
            fprintf(stderr, "importon: rank %d: %s%s\n", rank,
                    error ? "" : "warning: ", one + 1);
    }
}

int ranks_close(int rc)
{
    if (r.mpi) {
        FUNCTION(imp_mpi_end)(r.mpi, &rc, r.said, other_said, NULL);
        FUNCTION(imp_mpi_close)(r.mpi);
        r.mpi = NULL;
    }
    /* mpirun ends everybody at the first code that is not 0, and gives that back. */
    return r.rank == 0 || r.unable ? rc : EXIT_DONE;
}
