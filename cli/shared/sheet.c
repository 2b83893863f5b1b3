/* SPDX-License-Identifier: Apache-2.0
 *
 * A contact sheet: pictures side by side on one scale, small ones enlarged. */
#include "sheet.h"

#include "command.h"
#include "picture_files.h"
#include "proof.h"
#include "ranks.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define TILE    128 /* pixels that the longer side of a picture should have at least */
#define GAP     4
#define LARGEST (1 << 26) /* pixels of a sheet */

void sheet_add(struct sheet *s, const char *path)
{
    const char *dot = strrchr(path, '.');
    const size_t stem = dot ? (size_t)(dot - path) : strlen(path);
    char **grown = realloc(s->picture, (s->n + 1) * sizeof *grown);
    char *name = cli_alloc(stem + 5, 1);
    if (!grown) exit(cli_error(EXIT_RUN, "out of memory"));
    memcpy(name, path, stem);
    memcpy(name + stem, ".png", 5);
    s->picture = grown;
    s->picture[s->n++] = name;
}

void sheet_free(struct sheet *s)
{
    for (size_t i = 0; i < s->n; i++) free(s->picture[i]);
    free(s->picture);
    *s = (struct sheet){NULL, 0};
}

/* Copy one picture, magnified, to tile i; grey becomes colour. */
static void place(imp_film *from, imp_film *sheet, size_t x0, size_t y0, size_t zoom)
{
    struct imp_film_info a = {.size = sizeof a}, b = {.size = sizeof b};
    imp_film_get_info(from, &a);
    imp_film_get_info(sheet, &b);
    const float *in = imp_film_mean(from);
    float *out = imp_film_mean(sheet);
    const size_t w = (size_t)a.width * zoom, h = (size_t)a.height * zoom;
    for (size_t y = 0; y < h; y++)
        for (size_t x = 0; x < w; x++)
            for (size_t c = 0; c < 3; c++) {
                const size_t channel = a.channels >= 3 ? c : 0;
                out[((y0 + y) * (size_t)b.width + x0 + x) * 3 + c] =
                    in[(y / zoom * (size_t)a.width + x / zoom) * (size_t)a.channels +
                       channel];
            }
}

/* Width and height of the tile that every picture fits into, and how much they grow. */
static int tile_size(const struct sheet *s, size_t *w, size_t *h, size_t *zoom)
{
    struct imp_film_info info = {.size = sizeof info};
    *w = *h = 1;
    for (size_t i = 0; i < s->n; i++) {
        imp_film *film;
        const int rc = picture_read(s->picture[i], &film);
        if (rc) return rc;
        imp_film_get_info(film, &info);
        imp_film_destroy(film);
        if ((size_t)info.width > *w) *w = (size_t)info.width;
        if ((size_t)info.height > *h) *h = (size_t)info.height;
    }
    const size_t side = *w > *h ? *w : *h;
    *zoom = (TILE + side - 1) / side;
    *w = *w * *zoom + GAP;
    *h = *h * *zoom + GAP;
    return 0;
}

int sheet_write(const struct sheet *s, size_t columns, const char *path)
{
    struct imp_write_options options = IMP_WRITE_OPTIONS_INIT;
    imp_film *sheet = NULL;
    size_t zoom, w, h;
    if (!cli_writes()) return 0;
    ranks_leave(); /* the pictures are read here only */
    int rc = tile_size(s, &w, &h, &zoom);
    if (rc) return rc;
    const size_t rows = (s->n + columns - 1) / columns;
    const size_t width = columns * w - GAP, height = rows * h - GAP;
    if (width > LARGEST / height)
        return cli_error(EXIT_USAGE, "%s: a sheet of %zu x %zu pixels is too large", path,
                         width, height);
    if (cli_failed(
            imp_film_create(cli.context, (int)width, (int)height, "R,G,B", &sheet)))
        return cli_fail(IMP_E_NOMEM, path);
    for (size_t k = 0; k < width * height * 3; k++) imp_film_mean(sheet)[k] = 1;
    for (size_t i = 0; i < s->n && !rc; i++) {
        imp_film *film;
        rc = picture_read(s->picture[i], &film);
        if (rc) break;
        place(film, sheet, i % columns * w, i / columns * h, zoom);
        imp_film_destroy(film);
    }
    if (!rc) {
        const enum imp_status st = imp_film_write(sheet, path, &options);
        if (st != IMP_OK) rc = cli_fail(st, NULL);
        else manifest_wrote(path);
    }
    imp_film_destroy(sheet);
    return rc;
}
