/* SPDX-License-Identifier: Apache-2.0
 *
 * Parts of any cut, and parts of parts: random cuts merge, in any order and by way of any
 * larger parts, to the bits of one run; and a merge makes no walk. */
#include "parts_kit.h"
#include <unistd.h>

enum { MOST = 24 };

static uint64_t state;
static int draw(int n) /* 0 <= . < n */
{
    state = state * 6364136223846793005u + 1442695040888963407u;
    return (int)((state >> 33) % (uint64_t)n);
}

/* Random parts of a run, i/n each: one part is cut into several, again and again. */
static int cut_make(int part[MOST][2])
{
    int n = 1;
    part[0][0] = part[0][1] = 1;
    for (int k = 0; k < 6; k++) {
        const int which = draw(n), pieces = 2 + draw(3);
        const int i = part[which][0], of = part[which][1];
        if (n + pieces - 1 > MOST || of * pieces > 5000) continue;
        for (int j = 0; j < pieces; j++) {
            const int to = j == 0 ? which : n++;
            part[to][0] = (i - 1) * pieces + 1 + j;
            part[to][1] = of * pieces;
        }
    }
    for (int k = n - 1; k > 0; k--) { /* in any order */
        const int j = draw(k + 1);
        for (int c = 0; c < 2; c++) {
            const int t = part[k][c];
            part[k][c] = part[j][c];
            part[j][c] = t;
        }
    }
    return n;
}

/* The first `n` files become one. */
static void join(const char *paths[], int n, const char *to)
{
    imp_parts *parts;
    imp_context *ctx = test_context(1);
    test_must(ctx, imp_parts_read(ctx, paths, (size_t)n, &parts));
    test_must(ctx, imp_parts_write(parts, to));
    imp_parts_destroy(parts);
    imp_context_destroy(ctx);
}

static void cut(const char *filter, enum job job, uint64_t seed)
{
    static struct result whole, merged;
    int part[MOST][2];
    char name[MOST + 4][96];
    const char *path[MOST + 4];
    imp_parts *parts = NULL;
    state = seed;
    alone(filter, job, &whole);
    atomic_store(&looked, 0);
    int n = cut_make(part);
    for (int k = 0; k < n; k++) {
        part_make(filter, job, part[k][0], part[k][1], 1 + k % 2);
        path[k] = part_path(name[k], part[k][0], part[k][1]);
    }
    const int cuts = n;
    const uint64_t walks = atomic_exchange(&looked, 0);
    /* Some of them, twice, by way of a larger part. */
    for (int j = 0; j < 2 && n > 3; j++) {
        const int some = 2 + draw(n - 2);
        snprintf(name[MOST + j], sizeof name[0], "%s/joined%d", folder, j);
        join(path, some, name[MOST + j]);
        memmove(path, path + some, (size_t)(n - some) * sizeof *path);
        n -= some;
        path[n++] = name[MOST + j];
    }
    imp_context *ctx = test_context(2);
    imp_scene *s = scene_make(ctx, filter, .6);
    atomic_store(&looked, 0); /* how a scene is built is no walk */
    enum imp_status st = imp_parts_read(ctx, path, (size_t)n, &parts);
    if (st == IMP_OK) st = imp_context_set_parts(ctx, parts);
    if (st == IMP_OK) st = job_run(ctx, s, job, 5, &merged);
    const uint64_t again = atomic_load(&looked);
    tap_ok(st == IMP_OK && !memcmp(&merged, &whole, sizeof whole),
           "%s, %s: %d parts, merged by way of larger ones, to the bit # %s", names[job],
           filter, cuts, imp_last_error(ctx));
    tap_ok(
        walks > 100 && again == 0,
        "%s, %s: walks of the parts met the pebble %llu times, those of the merge %llu",
        names[job], filter, (unsigned long long)walks, (unsigned long long)again);
    imp_parts_destroy(parts);
    imp_scene_destroy(s);
    imp_context_destroy(ctx);
    for (int k = 0; k < cuts; k++) remove(name[k]);
}

int main(void)
{
    snprintf(folder, sizeof folder, "/tmp/parts_cuts.XXXXXX");
    if (!mkdtemp(folder)) return 99;
    target_set();
    for (enum job job = 0; job < JOBS; job++) {
        cut("box", job, 3 * job + 1);
        cut("gaussian", job, 3 * job + 2);
    }
    char command[96];
    snprintf(command, sizeof command, "rm -r %s", folder);
    if (system(command) != 0) tap_ok(0, "the folder is removed");
    return tap_done();
}
