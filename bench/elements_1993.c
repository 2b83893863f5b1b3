/* SPDX-License-Identifier: Apache-2.0
 *
 * The experiment of Christensen, Salesin and DeRose 1993, again: four scenes of our own
 * making (scenes/elements), refined with and without importance.
 *
 *     elements_1993 FOLDER
 *
 * writes figure 1 (a to d, interpolated), figure 2 (b and d, flat) and figure 3 (error
 * against links: figure3.svg) to the folder, and the table to standard output as JSON.
 * Errors are RMS over the flat picture, relative to the RMS of a reference that the same
 * program made without importance with several times the links. "Total" counts a link
 * once for radiance and once more for importance. */
#include <importon/elements.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

enum { MOST = 24 };

struct curve { /* one way of refining one scene */
    int n;
    double links[MOST], rms[MOST], seconds[MOST];
};
struct experiment {
    const char *name, *file;
    int glossy, beams, steps;
    double reference_eps;
    struct curve without, with;
    double links_reference, mean_reference, bytes_link, bytes_element;
};

static imp_context *ctx;
static const char *folder;

static void must(enum imp_status st)
{
    if (st == IMP_OK) return;
    fprintf(stderr, "elements_1993: %s: %s\n", imp_status_text(st), imp_last_error(ctx));
    exit(3);
}

/* Of all threads: what counts on a machine with other work. */
static double processor(void)
{
    struct timespec t;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static double now(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static imp_scene *scene_of(const char *file)
{
    struct imp_load_options o = IMP_LOAD_OPTIONS_INIT;
    char path[1024];
    imp_scene *s;
    o.mode = IMP_MONO;
    snprintf(path, sizeof path, "%s/elements/%s", IMP_SCENES, file);
    must(imp_scene_load(ctx, path, &o, &s));
    return s;
}

static imp_elements *solved(const struct experiment *x, imp_scene *s, double eps,
                            int without)
{
    static const struct imp_elements_phong wall = {
        sizeof wall, "*", {0.1, 0.1, 0.1}, {0.6, 0.6, 0.6}, 15};
    static const char *const lamp[12] = {
        "light_left", "light_right", "light_ceiling", "light_back", "extra_0", "extra_1",
        "extra_2",    "extra_3",     "extra_4",       "extra_5",    "extra_6", "extra_7"};
    struct imp_elements_beam beams[12] = {{0}};
    struct imp_elements_options o = IMP_ELEMENTS_OPTIONS_INIT;
    imp_elements *e;
    for (int k = 0; k < x->beams; k++) {
        beams[k].size = sizeof *beams;
        beams[k].shape = lamp[k];
        beams[k].exponent = 20;
    }
    o.order = 8;
    o.phong = &wall;
    o.n_phong = (size_t)x->glossy;
    o.beams = beams;
    o.n_beams = (size_t)x->beams;
    o.stop = -1;
    o.eps_last = eps;
    o.no_importance = without;
    must(imp_elements_create(s, &o, &e));
    must(imp_elements_solve(e));
    return e;
}

static imp_film *picture(const imp_elements *e, enum imp_elements_image kind)
{
    imp_film *f;
    must(imp_elements_image(e, 0, kind, 3, &f));
    return f;
}

static void write_figure(imp_film *f, const char *name, int glossy)
{
    struct imp_write_options o = IMP_WRITE_OPTIONS_INIT;
    char path[1024];
    snprintf(path, sizeof path, "%s/%s.png", folder, name);
    o.exposure = glossy ? 1.5 : 1;
    must(imp_film_write(f, path, &o));
}

static double rms(imp_film *a, imp_film *b)
{
    struct imp_film_info info = {.size = sizeof info};
    imp_film_get_info(a, &info);
    const size_t n = (size_t)info.width * (size_t)info.height;
    const float *x = imp_film_mean(a), *y = imp_film_mean(b);
    double apart = 0, sum = 0;
    for (size_t k = 0; k < n; k++) {
        apart += ((double)x[k] - y[k]) * ((double)x[k] - y[k]);
        sum += (double)y[k] * y[k];
    }
    return sqrt(apart / sum);
}

static void run(struct experiment *x)
{
    struct imp_elements_info info = {.size = sizeof info};
    imp_scene *s = scene_of(x->file);
    imp_elements *e = solved(x, s, x->reference_eps, 1);
    imp_film *reference = picture(e, IMP_ELEMENTS_FLAT);
    char name[64];
    must(imp_elements_get_info(e, &info));
    x->links_reference = (double)info.links;
    x->mean_reference = info.measure;
    x->bytes_link = info.bytes_per_link;
    x->bytes_element = info.bytes_per_element;
    imp_film *smooth = picture(e, IMP_ELEMENTS_GOURAUD);
    snprintf(name, sizeof name, "figure1%s", x->name);
    write_figure(smooth, name, x->beams);
    snprintf(name, sizeof name, "figure2%s", x->name);
    write_figure(reference, name, x->beams);
    imp_film_destroy(smooth);
    imp_elements_destroy(e);
    for (int without = 0; without < 2 && x->steps; without++) {
        struct curve *c = without ? &x->without : &x->with;
        double eps = 0.0125;
        for (int k = 0; k < x->steps && eps > 6 * x->reference_eps; k++, eps /= 2) {
            const double start = now();
            e = solved(x, s, eps, without);
            c->seconds[c->n] = now() - start;
            must(imp_elements_get_info(e, &info));
            imp_film *f = picture(e, IMP_ELEMENTS_FLAT);
            c->links[c->n] = (double)info.links;
            c->rms[c->n++] = rms(f, reference);
            imp_film_destroy(f);
            imp_elements_destroy(e);
        }
    }
    imp_film_destroy(reference);
    imp_scene_destroy(s);
}

/* Links at which the error falls to `level` for good: log-log, from the fine end. */
static double links_at(const struct curve *c, double level)
{
    for (int k = c->n - 1; k > 0; k--) {
        if (c->rms[k] > level) return NAN;
        if (c->rms[k - 1] < level) continue;
        const double t = log(c->rms[k - 1] / level) / log(c->rms[k - 1] / c->rms[k]);
        return c->links[k - 1] * pow(c->links[k] / c->links[k - 1], t);
    }
    return NAN;
}

/* ---- Figure 3 ------------------------------------------------------------------ */

static void draw(FILE *f, const struct curve *c, double factor, double left,
                 const char *style)
{
    fprintf(f, "<path fill=\"none\" stroke-width=\"2\" %s d=\"", style);
    for (int k = 0; k < c->n; k++)
        fprintf(f, "%c%.1f %.1f ", k ? 'L' : 'M',
                left + 320 * (log10(factor * c->links[k]) - 2) / 5,
                360 - 300 * (log10(100 * c->rms[k]) + 1) / 3);
    fprintf(f, "\"/>\n");
}

static void figure3(const struct experiment *x, int n)
{
    char path[1024];
    snprintf(path, sizeof path, "%s/figure3.svg", folder);
    FILE *f = fopen(path, "w");
    if (!f) {
        perror(path);
        exit(3);
    }
    fprintf(f,
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"%d\" height=\"420\" "
            "font-family=\"sans-serif\" font-size=\"12\">\n<rect width=\"100%%\" "
            "height=\"100%%\" fill=\"white\"/>\n",
            400 * n + 20);
    for (int i = 0; i < n; i++) {
        const double left = 60 + 400 * i;
        fprintf(
            f,
            "<text x=\"%g\" y=\"24\" font-size=\"15\">scene %s: RMS error (%%) against "
            "links</text>\n",
            left, x[i].name);
        for (int k = -1; k <= 2; k++)
            fprintf(f,
                    "<line x1=\"%g\" x2=\"%g\" y1=\"%d\" y2=\"%d\" stroke=\"#ccc\"/>"
                    "<text x=\"%g\" y=\"%d\" text-anchor=\"end\">%g</text>\n",
                    left, left + 320, 260 - 100 * k, 260 - 100 * k, left - 6,
                    264 - 100 * k, pow(10, k));
        for (int k = 2; k <= 7; k++)
            fprintf(f, "<text x=\"%g\" y=\"380\" text-anchor=\"middle\">1e%d</text>\n",
                    left + 64 * (k - 2), k);
        draw(f, &x[i].without, 1, left, "stroke=\"#b03030\"");
        draw(f, &x[i].with, 2, left, "stroke=\"#2050b0\"");
        draw(f, &x[i].with, 1, left, "stroke=\"#2050b0\" stroke-dasharray=\"5 4\"");
    }
    fprintf(
        f,
        "<text x=\"60\" y=\"408\"><tspan fill=\"#b03030\">without importance</tspan>"
        "<tspan fill=\"#2050b0\" dx=\"20\">with importance: all links; dashed: those of "
        "radiance</tspan></text>\n</svg>\n");
    fclose(f);
}

static void print_curve(const char *name, const struct curve *c)
{
    printf("\"%s\":[", name);
    for (int k = 0; k < c->n; k++)
        printf("%s{\"links\":%.0f,\"rms\":%.6f,\"seconds\":%.3f}", k ? "," : "",
               c->links[k], c->rms[k], c->seconds[k]);
    printf("]");
}

static void print_number(double x)
{
    if (isfinite(x)) printf("%.4g", x);
    else printf("null");
}

static void print(const struct experiment *x)
{
    static const double levels[] = {0.08, 0.05, 0.035, 0.025, 0.015};
    printf("{\"scene\":\"%s\",\"reference_links\":%.0f,\"mean\":%.6g,\"bytes_per_link\":%"
           ".0f,"
           "\"bytes_per_element\":%.0f,",
           x->name, x->links_reference, x->mean_reference, x->bytes_link,
           x->bytes_element);
    print_curve("without", &x->without);
    printf(",");
    print_curve("with", &x->with);
    printf(",\"at\":[");
    for (size_t k = 0; k < sizeof levels / sizeof *levels; k++) {
        const double a = links_at(&x->without, levels[k]),
                     b = links_at(&x->with, levels[k]);
        printf("%s{\"rms\":%g,\"links_without\":", k ? "," : "", levels[k]);
        print_number(a);
        printf(",\"radiance_links_with\":");
        print_number(b);
        printf(",\"ratio\":");
        print_number(b / a);
        printf(",\"total_ratio\":");
        print_number(2 * b / a);
        printf("}");
    }
    printf("]}");
}

int main(int argc, char **argv)
{
    struct imp_context_options co = IMP_CONTEXT_OPTIONS_INIT;
    static struct experiment x[] = {
        {.name = "b", .file = "b.xml", .steps = 12, .reference_eps = 2e-6},
        {.name = "d",
         .file = "d.xml",
         .glossy = 1,
         .beams = 4,
         .steps = 12,
         .reference_eps = 3e-6},
        {.name = "d_lamps",
         .file = "d_lamps.xml",
         .glossy = 1,
         .beams = 12,
         .steps = 12,
         .reference_eps = 3e-6},
        {.name = "a", .file = "a.xml", .reference_eps = 1e-5},
        {.name = "c", .file = "d.xml", .beams = 4, .reference_eps = 1e-5}};
    const double start = now();
    if (argc != 2 || argv[1][0] == '-') {
        fprintf(stderr, "usage: elements_1993 FOLDER >table.json\n"
                        "Writes 11 figures into the folder; takes about a minute.\n");
        return 2;
    }
    folder = argv[1];
    co.threads = 2;
    must(imp_context_create(&co, &ctx));
    printf("{\"experiment\":\"Christensen, Salesin, DeRose 1993\",\"scenes\":[");
    for (int k = 0; k < 5; k++) {
        run(&x[k]);
        fprintf(stderr, "scene %s: %.1f s\n", x[k].name, now() - start);
        if (k) printf(",\n");
        print(&x[k]);
    }
    figure3(x, 3);
    printf("],\n\"seconds\":%.1f,\"processor_seconds\":%.1f,\n", now() - start,
           processor());
    printf("\"threads\":2}\n");
    imp_context_destroy(ctx);
    return 0;
}
