/* SPDX-License-Identifier: Apache-2.0
 *
 * The answer of importon gradient. */
#include "gradient_answer.h"
#include "shared/command.h"
#include "shared/picture_files.h"
#include "shared/places.h"
#include "shared/plot.h"
#include "shared/problem_options.h"
#include "shared/wanted.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* ---- Numbers ----------------------------------------------------------------- */

void gradient_json(const struct imp_run *run, double until,
                   const struct gradient_answer *r, const struct block *blocks,
                   size_t n_blocks, char **paths)
{
    static const char *const bias[] = {"none", "O(1/N)", "O(1/N^2)"};
    struct json j = cli_json();
    json_seed(&j, "seed", run->seed);
    json_integer(&j, "spp", (int64_t)r->spp * r->rounds);
    json_integer(&j, "spp_taken", (int64_t)r->spp_taken * r->rounds);
    json_text(&j, "functional", r->functional);
    if (!strcmp(r->functional, "loss")) json_text(&j, "loss", loss_word());
    json_number(&j, "value", r->value.value);
    json_number(&j, "se", r->value.se);
    json_text(
        &j, "bias",
        bias[r->value.bias_order >= 0 && r->value.bias_order <= 2 ? r->value.bias_order
                                                                  : 0]);
    if (until > 0) until_json(&j, until, &r->end);
    json_array(&j, "params");
    for (size_t k = 0; k < n_blocks; k++) {
        const struct block *b = &blocks[k];
        block_json(&j, b);
        if (block_is_large(b)) {
            json_integer(&j, "count", (int64_t)b->n);
            json_text(&j, "file", paths[k]);
        } else if (b->n == 1) {
            json_number(&j, "value", r->x[b->first]);
            json_number(&j, "grad", r->grad[b->first]);
            json_number(&j, "se", r->se[b->first]);
        } else {
            json_numbers(&j, "value", b->n, r->x + b->first);
            json_numbers(&j, "grad", b->n, r->grad + b->first);
            json_numbers(&j, "se", b->n, r->se + b->first);
        }
        json_end_object(&j);
    }
    json_end_array(&j);
    places_json(&j, blocks, n_blocks, NULL);
    cli_json_end(&j);
}

void gradient_print(const struct gradient_answer *r, const struct block *blocks,
                    size_t n_blocks, char **paths)
{
    int width = 9;
    for (size_t k = 0; k < n_blocks; k++)
        if ((int)strlen(blocks[k].info.name) + 3 > width)
            width = (int)strlen(blocks[k].info.name) + 3;
    printf("%-*s  %-14.8g +- %.2g%s%s\n\n", width, r->functional, r->value.value,
           r->value.se,
           !strcmp(r->functional, "mean") ? "  (of the picture: all pixels and channels)"
                                          : "",
           r->value.bias_order == 1   ? "  (biased, O(1/N))"
           : r->value.bias_order == 2 ? "  (biased, O(1/N^2))"
                                      : "");
    printf("%-*s  %-14s %-14s %s\n", width, "parameter", "value", "gradient", "se");
    for (size_t k = 0; k < n_blocks; k++) {
        const struct block *b = &blocks[k];
        char name[512];
        if (block_is_large(b)) {
            double norm = 0, sum = 0;
            for (size_t i = 0; i < b->n; i++) {
                norm += r->grad[b->first + i] * r->grad[b->first + i];
                sum += r->grad[b->first + i];
            }
            printf("%-*s  %zu numbers: sum of gradient %.6g, norm %.6g%s%s\n", width,
                   b->info.name, b->n, sum, sqrt(norm), paths[k] ? " -> " : "",
                   paths[k] ? paths[k] : "");
            continue;
        }
        for (size_t i = 0; i < b->n; i++) {
            const size_t at = b->first + i;
            printf("%-*s  %-14.8g ", width,
                   cli_number_row(&b->info, i, name, sizeof name), r->x[at]);
            if (block_held(b, i)) printf("held\n");
            else printf("%-14.7g %.2g\n", r->grad[at], r->se[at]);
        }
    }
}

/* ---- Plots of spectra -------------------------------------------------------------- */

char *gradient_plot_path(const char *folder, const struct block *b)
{
    const size_t n = strlen(b->info.name) + 5;
    char *name = cli_alloc(n, 1);
    snprintf(name, n, "%s.svg", b->info.name);
    make_file_name(name);
    char *path = join_path(folder, name);
    free(name);
    return path;
}

/* A number of the spectrum moves a hat about its wavelength: by the hat's area the
 * derivative is that by the spectrum itself, per nm. */
int gradient_plot(const char *folder, const struct block *b,
                  const struct gradient_answer *r)
{
    const double *nm = b->info.wavelengths_nm;
    double *y = cli_alloc(2 * b->n, sizeof *y), *se = y + b->n;
    char label[256], *path = gradient_plot_path(folder, b);
    double most = 0;
    for (size_t k = 0; k < b->n; k++) {
        const double area = 0.5 * (nm[k + 1 < b->n ? k + 1 : k] - nm[k ? k - 1 : k]);
        y[k] = r->grad[b->first + k] / area;
        se[k] = r->se[b->first + k] / area;
        most = fmax(most, fabs(y[k]));
    }
    const double power = most > 0 ? 3 * floor(log10(most) / 3) : 0;
    for (size_t k = 0; k < 2 * b->n; k++) y[k] *= pow(10, -power);
    if (power == 0) snprintf(label, sizeof label, "d %s per nm", r->functional);
    else snprintf(label, sizeof label, "d %s per nm, 1e%g", r->functional, power);
    const int rc = plot_spectrum(path, b->info.name, label, b->n, nm, y, se);
    free(path);
    free(y);
    return rc;
}
int gradient_is_spectrum(const struct block *b)
{
    return b->info.wavelengths_nm && b->n > 1;
}
