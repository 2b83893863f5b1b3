/* SPDX-License-Identifier: Apache-2.0
 *
 * Two builds of the program beside each other, say of today and of a month ago: processor
 * seconds (user and system) and peak memory of pictures, losses with gradients and checks,
 * one thread each. Memory is told in all, and without the pages of program and libraries,
 * which are a part of files that all processes share. Both are looked at every millisecond or
 * two, in the page tables (/proc/PID/smaps_rollup): the kernel's own maximum is made of counters
 * that each core keeps for itself, and is wrong by some hundred kB. A round runs every job once
 * with either build, in turn. Of seconds, the minimum of all rounds counts; of memory the
 * median, since a round may miss its peak. Prints a table for docs/speed.md.
 * bench/link_order.py tells which files should be linked side by side.
 *
 *     versions [--rounds N] [--job TEXT] [--scenes FOLDER] OLD NEW
 *
 * OLD and NEW are paths of two cli/importon; FOLDER has scenes that both can read: those
 * of the older one. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

enum { WORDS_MAX = 32, ROUNDS_MAX = 99 };

struct job {
    const char *name;
    const char *words[WORDS_MAX]; /* of the command line, after the program */
    double seconds[2], mib[2][ROUNDS_MAX], own[2][ROUNDS_MAX]; /* of old and new build */
};

#define CORNELL  "@cornell.xml", "-D", "res=128"
#define TEXTURED "@textured.xml", "-D", "width=160", "-D", "height=120"
#define PICTURE  "--no-preview", "-o", "picture.exr"

static struct job jobs[] = {
    {.name = "picture, Cornell box",
     .words = {"render", CORNELL, "--spp", "64", PICTURE}},
    {.name = "picture, textured", .words = {"render", TEXTURED, "--spp", "64", PICTURE}},
    {.name = "loss + gradient, Cornell box",
     .words = {"gradient", CORNELL, "--spp", "64", "-T", "cornell.exr"}},
    {.name = "loss + gradient, textured",
     .words = {"gradient", TEXTURED, "--spp", "64", "-T", "textured.exr"}},
    {.name = "check, Cornell box",
     .words = {"check", "@cornell.xml", "-D", "res=48", "--paths", "200", "--fresh-spp",
               "16"}},
    {.name = "check, textured, reflectances",
     .words = {"check", "@textured.xml", "-D", "width=96", "-D", "height=72", "--paths",
               "200", "--fresh-spp", "16", "-p", "*reflectance*"}}};
enum { JOBS = sizeof jobs / sizeof jobs[0] };

static const char *const targets[][WORDS_MAX] = {
    {"render", CORNELL, "--spp", "32", "--seed", "7", "--no-preview", "-o",
     "cornell.exr"},
    {"render", TEXTURED, "--spp", "32", "--seed", "7", "--no-preview", "-o",
     "textured.exr"}};

static const char *scenes = IMP_SCENES; /* where "@..." of a command line is */

/* Resident memory in all and that of no file, MiB: the larger of what is there and what was
 * seen. */
static void look(pid_t pid, double *all, double *own)
{
    char name[64], line[256];
    long kib;
    snprintf(name, sizeof name, "/proc/%ld/smaps_rollup", (long)pid);
    FILE *f = fopen(name, "r");
    if (!f) return;
    while (fgets(line, sizeof line, f)) {
        if (sscanf(line, "Rss: %ld", &kib) == 1 && (double)kib / 1024 > *all)
            *all = (double)kib / 1024;
        if (sscanf(line, "Anonymous: %ld", &kib) == 1 && (double)kib / 1024 > *own)
            *own = (double)kib / 1024;
    }
    fclose(f);
}

/* Run it once; its processor seconds and peak memory. This program is small: what a child
 * has before it becomes `program` does not count. */
static void run(const char *program, const char *const *words, double *seconds,
                double *mib, double *own)
{
    char *argv[WORDS_MAX + 5] = {(char *)program}, scene[4096];
    struct rusage usage;
    int n = 1, status;
    for (; *words; words++) {
        argv[n++] = (*words)[0] == '@' ? scene : (char *)*words;
        if ((*words)[0] == '@')
            snprintf(scene, sizeof scene, "%s/%s", scenes, *words + 1);
    }
    argv[n++] = "-t", argv[n++] = "1", argv[n++] = "-q";
    unlink("picture.exr");
    const pid_t pid = fork();
    if (pid == 0) {
        if (!freopen("/dev/null", "w", stdout)) _exit(127);
        execv(program, argv);
        _exit(127);
    }
    *mib = *own = 0;
    while (wait4(pid, &status, WNOHANG, &usage) == 0) {
        look(pid, mib, own);
        usleep(1000);
    }
    /* 1: a check that a difference stays too noisy for. */
    if (!WIFEXITED(status) || WEXITSTATUS(status) > 1) {
        fprintf(stderr, "versions: %s %s failed\n", program, argv[1]);
        exit(3);
    }
    const double s = (double)(usage.ru_utime.tv_sec + usage.ru_stime.tv_sec) +
                     1e-6 * (double)(usage.ru_utime.tv_usec + usage.ru_stime.tv_usec);
    if (s < *seconds) *seconds = s;
}

static int compare(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}
static double median(double *x, int n)
{
    qsort(x, (size_t)n, sizeof *x, compare);
    return n % 2 ? x[n / 2] : (x[n / 2 - 1] + x[n / 2]) / 2;
}

int main(int argc, char **argv)
{
    const char *program[2] = {NULL, NULL}, *wanted = "";
    char *path[2], work[] = "/tmp/versions-XXXXXX";
    int rounds = 9, n = 0;
    for (int k = 1; k < argc; k++) {
        if (!strcmp(argv[k], "--rounds") && k + 1 < argc) rounds = atoi(argv[++k]);
        else if (!strcmp(argv[k], "--job") && k + 1 < argc) wanted = argv[++k];
        else if (!strcmp(argv[k], "--scenes") && k + 1 < argc)
            scenes = realpath(argv[++k], NULL);
        else if (n < 2 && argv[k][0] != '-') program[n++] = argv[k];
        else n = 3;
    }
    if (n != 2 || rounds < 1 || rounds > ROUNDS_MAX || !scenes) {
        fprintf(stderr, "usage: versions [--rounds N] [--job TEXT] [--scenes FOLDER] "
                        "OLD NEW\n");
        return 2;
    }
    for (int b = 0; b < 2; b++)
        if (!(path[b] = realpath(program[b], NULL))) {
            fprintf(stderr, "versions: %s: no such program\n", program[b]);
            return 2;
        }
    if (!mkdtemp(work) || chdir(work) != 0) {
        fprintf(stderr, "versions: no folder to work in\n");
        return 3;
    }
    for (size_t t = 0; t < sizeof targets / sizeof targets[0]; t++) {
        double seconds = 1e30, mib, own;
        run(path[0], targets[t], &seconds, &mib, &own);
    }
    for (int k = 0; k < JOBS; k++)
        for (int b = 0; b < 2; b++) jobs[k].seconds[b] = 1e30;
    for (int r = 0; r < rounds; r++)
        for (int k = 0; k < JOBS; k++)
            for (int b = 0; strstr(jobs[k].name, wanted) && b < 2; b++)
                run(path[b], jobs[k].words, &jobs[k].seconds[b], &jobs[k].mib[b][r],
                    &jobs[k].own[b][r]);

    printf("| %d rounds | old s | new s | new / old | old MiB | new MiB | new / old | "
           "old own | new own | new / old |\n|---|---|---|---|---|---|---|---|---|---|\n",
           rounds);
    for (int k = 0; k < JOBS; k++) {
        struct job *j = &jobs[k];
        if (!strstr(j->name, wanted)) continue;
        const double mib[2] = {median(j->mib[0], rounds), median(j->mib[1], rounds)};
        const double own[2] = {median(j->own[0], rounds), median(j->own[1], rounds)};
        printf("| %s | %.3f | %.3f | %.3f | %.1f | %.1f | %.2f | %.2f | %.2f | %.2f |\n",
               j->name, j->seconds[0], j->seconds[1], j->seconds[1] / j->seconds[0],
               mib[0], mib[1], mib[1] / mib[0], own[0], own[1], own[1] / own[0]);
    }
    unlink("picture.exr"), unlink("cornell.exr"), unlink("textured.exr");
    if (chdir("/") == 0) rmdir(work);
    free(path[0]), free(path[1]);
    return 0;
}
