/* SPDX-License-Identifier: Apache-2.0
 *
 * Pictures as layers of one: names, values and errors, and what is refused leaves the
 * picture as it was. */
#include "base/film.h"
#include "imp_scene.h"
#include "imp_tap.h"
#include <string.h>

static imp_film *film_of(imp_context *ctx, const char *names, int width, bool se,
                         float first)
{
    imp_film *film = NULL;
    test_must(ctx, imp__film_create(ctx, width, 2, names, se, &film));
    for (size_t i = 0; i < imp__film_values(film); i++) {
        film->mean[i] = first + (float)i;
        if (se) film->se[i] = 0.01f * film->mean[i];
    }
    return film;
}

int main(void)
{
    imp_context *ctx = test_context(1);
    imp_film *film = film_of(ctx, "R,G,B", 3, true, 1),
             *other = film_of(ctx, "R,Y", 3, true, 100),
             *small = film_of(ctx, "R", 2, true, 0),
             *bare = film_of(ctx, "Z", 3, false, 500);
    test_must(ctx, imp_film_add_layer(film, other, "d.red"));
    bool good = film->channels == 5 && !strcmp(film->names[3], "d.red.R") &&
                !strcmp(film->names[4], "d.red.Y") && film->se;
    for (size_t i = 0; good && i < 6; i++)
        for (size_t c = 0; c < 5; c++) {
            const float v = c < 3 ? (float)(1 + 3 * i + c) : (float)(100 + 2 * i + c - 3);
            good &= film->mean[5 * i + c] == v && film->se[5 * i + c] == 0.01f * v;
        }
    tap_ok(good, "names, values and errors");

    static char long_name[200];
    memset(long_name, 'x', sizeof long_name - 1);
    const char *const names[] = {"", "a,b", "a b", long_name, "d.red"};
    int refused = 0;
    for (size_t i = 0; i < sizeof names / sizeof names[0]; i++)
        refused += imp_film_add_layer(film, other, names[i]) == IMP_E_ARG;
    refused += imp_film_add_layer(film, small, "d.small") == IMP_E_ARG;
    tap_ok(refused == 6 && film->channels == 5 && film->se,
           "bad names, the same names and other sizes are refused");

    test_must(ctx, imp_film_add_layer(film, bare, "bare"));
    tap_ok(film->channels == 6 && !film->se && film->mean[5] == 500 &&
               film->mean[11] == 501,
           "beside a picture without errors there are none");
    test_must(ctx, imp_film_add_layer(bare, bare, "itself"));
    tap_ok(bare->channels == 2 && bare->mean[0] == 500 && bare->mean[1] == 500,
           "of itself");
    imp_film_destroy(film);
    imp_film_destroy(other);
    imp_film_destroy(small);
    imp_film_destroy(bare);
    imp_context_destroy(ctx);
    return tap_done();
}
