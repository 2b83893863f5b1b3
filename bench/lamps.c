/* SPDX-License-Identifier: Apache-2.0
 *
 * Many lamps: variance times processor time of a picture whose light samples choose by the
 * tree, over that of even choice, at 10,000 lamps and, beside a guide, at 100.
 *
 *     lamps FOLDER [--spp N]
 *
 * Scenes are written to the folder, for bench/peers/lamps.py. Variances come from the spread
 * of independent pictures' pixels about their mean over all pictures. */
#include "../tests/lamps.h"
#include <importon/elements.h>
#include <string.h>
#include <time.h>

#define PICTURES 8

static imp_context *ctx;

static void must(enum imp_status st)
{
    if (st == IMP_OK) return;
    fprintf(stderr, "lamps: %s: %s\n", imp_status_text(st), imp_last_error(ctx));
    exit(3);
}

static double processor(void)
{
    struct timespec t;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

struct result {
    double mean, variance, seconds; /* of one sample, of a picture */
};

static struct result measured(const imp_scene *s, const imp_guide *guide, int spp)
{
    struct result r = {0, 0, INFINITY};
    struct imp_film_info info = {.size = sizeof info};
    double *sum = NULL, *squares = NULL;
    size_t n = 0;
    for (int k = 0; k < PICTURES; k++) {
        struct imp_run run = IMP_RUN_INIT;
        imp_film *f;
        run.spp = spp;
        run.seed = (uint64_t)k;
        run.guide = guide;
        const double start = processor();
        must(imp_render(s, &run, &f));
        r.seconds = fmin(r.seconds, processor() - start);
        imp_film_get_info(f, &info);
        n = (size_t)info.width * (size_t)info.height * (size_t)info.channels;
        if (!sum) sum = calloc(n, sizeof *sum);
        if (!squares) squares = calloc(n, sizeof *squares);
        if (!sum || !squares) abort();
        for (size_t i = 0; i < n; i++) {
            const double v = imp_film_mean(f)[i];
            sum[i] += v;
            squares[i] += v * v;
        }
        imp_film_destroy(f);
    }
    for (size_t i = 0; i < n; i++) {
        r.mean += sum[i] / PICTURES / (double)n;
        r.variance +=
            (squares[i] - sum[i] * sum[i] / PICTURES) / (PICTURES - 1) * spp / (double)n;
    }
    free(sum);
    free(squares);
    return r;
}

static imp_scene *scene(const char *folder, const struct lamps *l)
{
    struct imp_load_options o = IMP_LOAD_OPTIONS_INIT;
    char *text = lamps_text(l), path[1024];
    imp_scene *s;
    snprintf(path, sizeof path, "%s/%s%d_%s.xml", folder,
             l->points ? "points" : "squares", l->n, l->choice);
    FILE *f = fopen(path, "w");
    if (!f || fputs(text, f) < 0 || fclose(f) != 0) {
        fprintf(stderr, "lamps: cannot write %s\n", path);
        exit(3);
    }
    free(text);
    o.mode = IMP_RGB;
    must(imp_scene_load(ctx, path, &o, &s));
    return s;
}

static void row(const char *what, const struct result *even, const struct result *r)
{
    printf("%s mean %.5g picture %.4g variance %.4g variance x time %.4g\n", what,
           r->mean, r->seconds, r->variance,
           r->variance * r->seconds / (even->variance * even->seconds));
    fflush(stdout);
}

/* A guide knows the light of a scene by finite elements, which want lights with surfaces. */
static void guided(const imp_scene *s, const struct result *even, int spp,
                   const char *what)
{
    struct imp_elements_options eo = IMP_ELEMENTS_OPTIONS_INIT;
    struct imp_elements_guide_options o = IMP_ELEMENTS_GUIDE_OPTIONS_INIT;
    imp_elements *e;
    imp_guide *g;
    eo.stop = 0.05;
    const double start = processor();
    must(imp_elements_create(s, &eo, &e));
    must(imp_elements_solve(e));
    must(imp_elements_guide(e, &o, &g));
    const double made = processor() - start;
    const struct result r = measured(s, g, spp);
    row(what, even, &r);
    printf("# its solution took %.2f s\n", made);
    imp_guide_destroy(g);
    imp_elements_destroy(e);
}

int main(int argc, char **argv)
{
    struct imp_context_options co = IMP_CONTEXT_OPTIONS_INIT;
    int spp = 256;
    if (argc == 4 && strcmp(argv[2], "--spp") == 0) spp = atoi(argv[3]);
    else if (argc != 2) spp = 0;
    if (spp <= 0) {
        fprintf(stderr, "usage: lamps FOLDER [--spp N]\n");
        return 2;
    }
    co.threads = 1;
    must(imp_context_create(&co, &ctx));
    for (int points = 0; points < 2; points++)
        for (int n = 100; n <= 10000; n *= 100) {
            struct lamps l = {n, "weights", points, 32, 2, ""};
            const char *kind = points ? "points" : "squares";
            char what[64];
            imp_scene *s = scene(argv[1], &l);
            /* Even choice finds the lamp that matters once in so many samples. */
            const struct result even = measured(s, NULL, spp * (n > 100 ? 8 : 1));
            snprintf(what, sizeof what, "%s%d weights", kind, n);
            row(what, &even, &even);
            snprintf(what, sizeof what, "%s%d guide", kind, n);
            if (n == 100 && !points) guided(s, &even, spp, what);
            imp_scene_destroy(s);
            l.choice = "tree";
            s = scene(argv[1], &l);
            struct result r = measured(s, NULL, spp);
            if (n > 100) r.seconds *= 8; /* of as many samples */
            snprintf(what, sizeof what, "%s%d tree", kind, n);
            row(what, &even, &r);
            imp_scene_destroy(s);
        }
    imp_context_destroy(ctx);
    return 0;
}
