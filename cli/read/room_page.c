/* SPDX-License-Identifier: Apache-2.0
 *
 * The page of a room that a client is shown. */
#include "room_page.h"
#include "shared/command.h"
#include "shared/output.h"
#include "shared/picture_files.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static const char style[] =
    ":root{color-scheme:light;--ink:#1b1e23;--faint:#5d6470;--line:#d4d8de;--good:#"
    "1a7f37;"
    "--bad:#b42318;--warn:#8a5a00}*{box-sizing:border-box}body{margin:0;background:#fff;"
    "color:var(--ink);font:15px/1.5 system-ui,\"Segoe UI\",\"DejaVu Sans\",sans-serif}"
    "main{max-width:960px;margin:0 auto;padding:16px}h1{font-size:1.45em;margin:0 0 4px}"
    "h2{font-size:1.15em;margin:0 0 8px}section{margin:28px 0;break-inside:avoid}"
    "p{margin:4px 0;max-width:80ch}.faint{color:var(--faint)}"
    "table{border-collapse:collapse;font-variant-numeric:tabular-nums}th,td{padding:3px "
    "14px 3px 0;text-align:right;border-bottom:1px solid var(--line);white-space:nowrap}"
    "th:first-child,td:first-child{text-align:left}thead th{color:var(--faint);"
    "font-weight:600}.good{color:var(--good)}.bad{color:var(--bad)}.warn{color:var(--"
    "warn)}"
    "svg,img{max-width:100%;height:auto;display:block;margin:0 0 "
    "8px}.scroll{overflow-x:auto}";

static void text_put(FILE *f, const char *text)
{
    for (const char *c = text; *c; c++)
        if (strchr("<>&\"'", *c)) fprintf(f, "&#%d;", *c);
        else if ((unsigned char)*c >= 32) fputc(*c, f);
}

void room_page_add(struct room_page *p, struct grid *g)
{
    if (p->n_grids == PAGE_GRIDS) grid_free(g);
    else p->grid[p->n_grids++] = *g;
}

void room_page_free(struct room_page *p)
{
    for (size_t k = 0; k < p->n_grids; k++) grid_free(&p->grid[k]);
    p->n_grids = 0;
}

/* ---- What is wanted ----------------------------------------------------------------------- */

/* The worst glare rating of a grid with its 95 % interval. */
static int glare_find(const struct grid *g, struct imp_run run,
                      struct imp_interval_estimate *out)
{
    double *ugr = cli_alloc(2 * g->n, sizeof *ugr), *se = ugr + g->n;
    size_t worst = 0;
    run.sensor = g->sensor;
    const enum imp_status st = imp_grid_glare(cli.scene, &run, ugr, se);
    for (size_t i = 1; st == IMP_OK && i < g->n; i++)
        if (ugr[i] > ugr[worst]) worst = i;
    *out = (struct imp_interval_estimate){ugr[worst], ugr[worst] - 1.96 * se[worst],
                                          ugr[worst] + 1.96 * se[worst]};
    free(ugr);
    return st == IMP_OK ? 0 : cli_fail(st, cli.scene_path);
}

static int value_find(const struct room_page *p, const struct imp_design_want *w,
                      struct imp_run run, struct imp_interval_estimate *out)
{
    for (size_t k = 0; k < p->n_grids; k++) {
        const struct grid *g = &p->grid[k];
        if (g->sensor != w->sensor) continue;
        switch (w->of) {
        case IMP_WANT_AVERAGE: *out = g->summary.average; return 0;
        case IMP_WANT_MINIMUM: *out = g->summary.minimum; return 0;
        case IMP_WANT_MAXIMUM: *out = g->summary.maximum; return 0;
        case IMP_WANT_UNIFORMITY: *out = g->summary.uniformity; return 0;
        case IMP_WANT_UGR: return glare_find(g, run, out);
        }
    }
    return cli_error(EXIT_USAGE, "--want %s.%s: this grid is not read", want_sensor(w),
                     want_words[w->of]);
}

static int wants_put(FILE *f, const struct room_page *p, struct imp_run run, bool *met)
{
    if (p->n_wants == 0) return 0;
    fprintf(f,
            "<section>\n<h2>Wanted</h2>\n<div "
            "class=\"scroll\"><table>\n<thead><tr><th>Grid</th>"
            "<th></th><th>wanted</th><th>found</th><th>95 %% interval</th><th></th></tr>"
            "</thead>\n");
    for (size_t k = 0; k < p->n_wants; k++) {
        const struct imp_design_want *w = &p->want[k];
        const bool upper = want_is_upper(w);
        struct imp_interval_estimate e = {0, 0, 0};
        const int rc = value_find(p, w, run, &e);
        if (rc) return rc;
        const bool sure = imp_design_enough(w->of, upper ? e.hi : e.lo, w->value),
                   never = !imp_design_enough(w->of, upper ? e.lo : e.hi, w->value);
        *met &= sure;
        if (!sure)
            cli_say("importon: %s %s: %.4g%s%s [%.4g, %.4g], wanted %s %.4g: %s",
                    want_sensor(w), want_words[w->of], e.value, *want_unit(w) ? " " : "",
                    want_unit(w), e.lo, e.hi, upper ? "<=" : ">=", w->value,
                    never ? "not met" : "within the error");
        fprintf(f, "<tr><td>");
        text_put(f, want_sensor(w));
        fprintf(f,
                "</td><td>%s</td><td>%s %.4g %s</td><td>%.4g</td><td>%.4g to %.4g</td>"
                "<td class=\"%s\">%s</td></tr>\n",
                w->of == IMP_WANT_UGR ? "UGR" : want_words[w->of],
                upper ? "&#8804;" : "&#8805;", w->value, want_unit(w), e.value, e.lo,
                e.hi,
                sure    ? "good"
                : never ? "bad"
                        : "warn",
                sure    ? "met"
                : never ? "not met"
                        : "within the error");
    }
    fprintf(
        f, "</table></div>\n<p class=\"faint\">Each interval contains the true value "
           "with 95 %%; "
           "those of minima and of uniformities allow for the noise of every point.</p>\n"
           "</section>\n");
    return 0;
}

/* ---- Plans ------------------------------------------------------------------------------------ */

static void row_put(FILE *f, const char *what, const struct imp_interval_estimate *e,
                    const char *unit)
{
    fprintf(f, "<tr><td>%s</td><td>%.5g</td><td>%.5g to %.5g</td><td>%s</td></tr>\n",
            what, e->value, e->lo, e->hi, unit);
}

static void grid_put(FILE *f, const struct grid *g)
{
    const struct imp_grid_summary *s = &g->summary;
    char size[64];
    fprintf(f, "<section>\n<h2>");
    text_put(f, g->name);
    grid_size_text(g, size, sizeof size);
    fprintf(f, ": %s</h2>\n", size);
    grid_svg_put(f, g);
    fprintf(
        f,
        "<table>\n<thead><tr><th></th><th>found</th><th>95 %% interval</th><th></th></tr>"
        "</thead>\n");
    row_put(f, "average", &s->average, g->unit);
    row_put(f, "minimum", &s->minimum, g->unit);
    row_put(f, "maximum", &s->maximum, g->unit);
    row_put(f, "minimum/average", &s->uniformity, "");
    row_put(f, "minimum/maximum", &s->diversity, "");
    fprintf(f, "</table>\n</section>\n");
}

/* ---- Luminaires --------------------------------------------------------------------------------- */

/* "": it has none. */
static const char *file_of(const struct room_page *p, const struct imp_luminaire_info *l)
{
    const char *chosen = p->file_of ? p->file_of(l->name, p->payload) : "";
    return *chosen ? chosen : l->file ? l->file : "";
}

static int any_file(const struct room_page *p)
{
    int any = p->file_of != NULL;
    for (int i = 0; !any && i < imp_scene_n_luminaires(cli.scene); i++) {
        struct imp_luminaire_info l = {.size = sizeof l};
        any = imp_scene_get_luminaire(cli.scene, i, &l) == IMP_OK && l.file;
    }
    return any;
}

static void luminaires_put(FILE *f, const struct room_page *p)
{
    const int n = imp_scene_n_luminaires(cli.scene);
    double watts = 0, flux = 0;
    const int files = any_file(p);
    int all_watts = 1, rows = 0;
    if (n == 0) return;
    fprintf(f,
            "<section>\n<h2>Luminaires</h2>\n<div "
            "class=\"scroll\"><table>\n<thead><tr><th>Name"
            "</th>%s<th>position</th><th>dimmed "
            "to</th><th>maintenance</th><th>flux</th><th>power</th></tr></thead>\n",
            files ? "<th>file</th>" : "");
    for (int i = 0; i < n; i++) {
        struct imp_luminaire_info l = {.size = sizeof l};
        if (imp_scene_get_luminaire(cli.scene, i, &l) != IMP_OK) continue;
        const double level = p->level_of ? p->level_of(l.name, p->payload) : 1;
        const double full = p->watts_of ? p->watts_of(l.name, p->payload) : 0;
        const double w = full > 0 ? full * level : l.power;
        if (level == 0) continue;
        rows++;
        fprintf(f, "<tr><td>");
        text_put(f, l.name);
        if (files) {
            fprintf(f, "</td><td>");
            text_put(f, file_of(p, &l));
        }
        fprintf(f,
                "</td><td>%.4g, %.4g, %.4g</td><td>%.3g %%</td><td>%.3g</td><td>%.5g "
                "lm</td><td>",
                l.position[0], l.position[1], l.position[2], 100 * l.level, l.maintenance,
                l.flux);
        if (full > 0 || l.watts > 0) fprintf(f, "%.4g W", w);
        else all_watts = 0;
        fprintf(f, "</td></tr>\n");
        watts += w;
        flux += l.flux;
    }
    fprintf(f, "<tr><td>%d in all</td>%s<td></td><td></td><td></td><td>%.5g lm</td><td>",
            rows, files ? "<td></td>" : "", flux);
    if (all_watts) fprintf(f, "%.4g W", watts);
    fprintf(f, "</td></tr>\n</table></div>\n<p class=\"faint\">Flux in operation: with "
               "dimming and "
               "maintenance factor. Power goes with dimming.</p>\n</section>\n");
}

/* ---- The view -------------------------------------------------------------------------------------- */

static int camera_find(void)
{
    struct imp_scene_info scene = {.size = sizeof scene};
    imp_scene_get_info(cli.scene, &scene);
    for (int s = 0; s < scene.n_sensors; s++) {
        struct imp_sensor_info info = {.size = sizeof info};
        if (imp_scene_get_sensor(cli.scene, s, &info) == IMP_OK &&
            (!strcmp(info.type, "perspective") || !strcmp(info.type, "thinlens")))
            return s;
    }
    return -1;
}

static int by_value(const void *a, const void *b)
{
    const float x = *(const float *)a, y = *(const float *)b;
    return (x > y) - (x < y);
}

/* Stops that bring nine tenths of the values below .8. */
static double exposure_of(imp_film *film)
{
    struct imp_film_info info = {.size = sizeof info};
    if (imp_film_get_info(film, &info) != IMP_OK) return 0;
    const size_t n = (size_t)info.width * (size_t)info.height;
    float *v = cli_alloc(n, sizeof *v);
    for (size_t i = 0; i < n; i++)
        v[i] = imp_film_mean(film)[i * (size_t)info.channels + (info.channels > 1)];
    qsort(v, n, sizeof *v, by_value);
    const double bright = v[(size_t)(0.9 * (double)(n - 1))];
    free(v);
    return bright > 0 ? log2(0.8 / bright) : 0;
}

static void base64_put(FILE *f, FILE *from)
{
    static const char digit[] =
        "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    unsigned char b[3];
    for (size_t n; (n = fread(b, 1, 3, from)) > 0;) {
        for (size_t k = n; k < 3; k++) b[k] = 0;
        const char text[4] = {digit[b[0] >> 2], digit[(b[0] & 3) << 4 | b[1] >> 4],
                              n > 1 ? digit[(b[1] & 15) << 2 | b[2] >> 6] : '=',
                              n > 2 ? digit[b[2] & 63] : '='};
        fwrite(text, 1, 4, f);
    }
}

static int picture_put(FILE *f, imp_film *film)
{
    char path[] = "/tmp/importon-view-XXXXXX.png";
    struct imp_write_options o = IMP_WRITE_OPTIONS_INIT;
    const int fd = mkstemps(path, 4);
    if (fd < 0) return cli_error(EXIT_RUN, "%s: cannot be made", path);
    close(fd);
    o.exposure = exposure_of(film);
    const enum imp_status st = imp_film_write(film, path, &o);
    FILE *png = st == IMP_OK ? fopen(path, "rb") : NULL;
    if (png) {
        fprintf(f, "<img alt=\"view\" src=\"data:image/png;base64,");
        base64_put(f, png);
        fprintf(f, "\">\n");
        fclose(png);
    }
    unlink(path);
    return png ? 0 : st != IMP_OK ? cli_fail(st, NULL) : cli_error(EXIT_RUN, "%s", path);
}

static int view_put(FILE *f, struct imp_run run)
{
    imp_film *film = NULL;
    run.sensor = camera_find();
    if (run.sensor < 0) return 0;
    run.from = IMP_FROM_SCENE;
    run.spp = cli.spp;
    const enum imp_status st = imp_render(cli.scene, &run, &film);
    if (st != IMP_OK) return cli_fail(st, cli.scene_path);
    fprintf(f, "<section>\n<h2>View</h2>\n");
    const int rc = picture_put(f, film);
    fprintf(f, "</section>\n");
    imp_film_destroy(film);
    return rc;
}

/* ---- The page ---------------------------------------------------------------------------------------- */

static void command_put(FILE *f, const struct imp_run *run)
{
    fprintf(f,
            "<section class=\"faint\">\n<p>importon %s, seed %llu</p>\n<p><code>importon",
            imp_version(), (unsigned long long)run->seed);
    for (int k = 0; k < cli.argc; k++) {
        char *word = NULL;
        size_t size = 0;
        FILE *to = open_memstream(&word, &size);
        if (!to) break;
        quote_word(to, cli.argv[k]);
        fclose(to);
        fputc(' ', f);
        text_put(f, word);
        free(word);
    }
    fprintf(f, "</code></p>\n</section>\n");
}

int room_page_write(struct room_page *p, const char *path, struct imp_run run, bool *met)
{
    struct output out;
    *met = true;
    int rc = output_open(&out, path, OUTPUT_PAGE);
    if (rc) return rc;
    FILE *f = out.file;
    const char *name = strrchr(cli.scene_path, '/');
    name = name ? name + 1 : cli.scene_path;
    fprintf(
        f,
        "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n<meta "
        "name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n<meta "
        "http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; style-src "
        "'unsafe-inline'; img-src data:; base-uri 'none'; form-action 'none'\">\n"
        "<title>importon report: ");
    text_put(f, name);
    fprintf(f, "</title>\n<style>%s</style>\n</head>\n<body>\n<main>\n<h1>", style);
    text_put(f, name);
    fprintf(f, "</h1>\n");
    if (p->heading) {
        fprintf(f, "<p>");
        text_put(f, p->heading);
        fprintf(f, "</p>\n");
    }
    rc = wants_put(f, p, run, met);
    for (size_t k = 0; k < p->n_grids && !rc; k++) grid_put(f, &p->grid[k]);
    if (!rc) luminaires_put(f, p);
    if (!rc) rc = view_put(f, run);
    command_put(f, &run);
    fprintf(f, "</main>\n</body>\n</html>\n");
    return output_close(&out, rc);
}
