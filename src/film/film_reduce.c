/* SPDX-License-Identifier: Apache-2.0
 *
 * A picture of fewer pixels, by means of blocks: a photograph for a film of its size. */
#include "base/arguments.h"
#include "base/film.h"
#include "math/vec.h"
#include <importon/importon.h>
#include <math.h>
#include <string.h>

static char *names_of(const imp_film *f)
{
    size_t length = 1;
    for (int c = 0; c < f->channels; c++) length += strlen(f->names[c]) + 1;
    char *names = imp__alloc(f->ctx, length, 1);
    for (int c = 0; names && c < f->channels; c++) {
        if (c) strcat(names, ",");
        strcat(names, f->names[c]);
    }
    return names;
}

/* Sums over one block of a channel. */
struct block {
    double sum, square; /* of values, of squared errors */
    int clipped;
};

static struct block block_of(const imp_film *f, int x0, int y0, int nx, int ny, int c,
                             float white)
{
    struct block b = {0, 0, 0};
    for (int y = y0; y < y0 + ny; y++)
        for (int x = x0; x < x0 + nx; x++) {
            const size_t at =
                ((size_t)y * (size_t)f->width + (size_t)x) * (size_t)f->channels +
                (size_t)c;
            b.sum += (double)f->mean[at];
            if (f->se) b.square += imp__sqr((double)f->se[at]);
            b.clipped += f->mean[at] >= white;
        }
    return b;
}

enum imp_status imp_film_reduce(const imp_film *film, int width, int height, double white,
                                imp_film **out)
{
    enum imp_status st = IMP_OK;
    imp_film *made = NULL;
    char *names = NULL;
    IMP_REQUIRE(NULL, film, "film");
    IMP_REQUIRE(film->ctx, out, "out");
    IMP_FLOAT_MODE;
    imp_context *ctx = film->ctx;
    *out = NULL;
    if (!(white > -INFINITY))
        return imp__error(ctx, IMP_E_ARG, "imp_film_reduce: white is %g", white);
    if (width < 1 || height < 1 || film->width % width || film->height % height)
        return imp__error(
            ctx, IMP_E_ARG,
            "imp_film_reduce: %d x %d pixels are not whole parts of %d x %d", width,
            height, film->width, film->height);
    const int nx = film->width / width, ny = film->height / height;
    const double n = (double)nx * (double)ny;
    names = names_of(film);
    if (!names) IMP_TRY(imp__error(ctx, IMP_E_NOMEM, "no memory for a picture"));
    IMP_TRY(imp__film_create(ctx, width, height, names, film->se != NULL, &made));
    for (int y = 0; y < height; y++)
        for (int x = 0; x < width; x++)
            for (int c = 0; c < film->channels; c++) {
                const size_t at =
                    ((size_t)y * (size_t)width + (size_t)x) * (size_t)film->channels +
                    (size_t)c;
                const struct block b =
                    block_of(film, x * nx, y * ny, nx, ny, c, (float)white);
                const bool some = b.clipped > 0 && b.clipped < nx * ny;
                made->mean[at] = some        ? NAN
                                 : b.clipped ? (float)white
                                             : (float)(b.sum / n);
                if (made->se) made->se[at] = some ? NAN : (float)(sqrt(b.square) / n);
            }
    *out = made;
    made = NULL;
out:
    imp_film_destroy(made);
    imp__release(ctx, names);
    return st;
}
