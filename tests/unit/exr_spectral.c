/* SPDX-License-Identifier: Apache-2.0
 *
 * Spectral pictures in EXR: names there and back, films of S0, S1 and T through a file, and
 * the colours of flat spectra: equal energy is X = Y = Z, and what reflects all is white. */
#include "format/exr_spectral.h"
#include "color/rgb.h"
#include "imp_scene.h"
#include "imp_tap.h"
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static void names(void)
{
    static const struct {
        const char *film, *file;
        double nm;
    } cases[] = {{"S0.550nm", "S0.550,000000nm", 550},
                 {"S3.412.5nm", "S3.412,500000nm", 412.5},
                 {"T.1050.25nm", "T.1050,250000nm", 1050.25},
                 {"se.S0.405nm", "se.S0.405,000000nm", 0},
                 {"S4.550nm", "S4.550nm", 0},
                 {"S0.nm", "S0.nm", 0},
                 {"S0.-5nm", "S0.-5nm", 0},
                 {"S0.550nmx", "S0.550nmx", 0},
                 {"T", "T", 0},
                 {"R", "R", 0},
                 {"se.R", "se.R", 0},
                 {"albedo.R", "albedo.R", 0}};
    int wrong = 0;
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        char file[IMP_EXR_NAME_ROOM], film[IMP_EXR_NAME_ROOM];
        imp__exr_name_to_file(cases[i].film, file);
        imp__exr_name_to_film(cases[i].file, film);
        if (strcmp(file, cases[i].file) == 0 && strcmp(film, cases[i].film) == 0 &&
            imp__exr_wavelength(cases[i].film, NULL) == cases[i].nm)
            continue;
        printf("# %s -> %s, %s -> %s\n", cases[i].film, file, cases[i].file, film);
        wrong++;
    }
    tap_ok(wrong == 0, "names of films and of files");
    char film[IMP_EXR_NAME_ROOM];
    imp__exr_name_to_film("T.400,5nm.500,5nm", film); /* of fluorescence: kept apart */
    tap_ok(strcmp(film, "T.400.5nm.500.5nm") == 0 && imp__exr_wavelength(film, NULL) == 0,
           "two wavelengths are no channel of one");
}

static void round_trip(imp_context *ctx)
{
    static const char list[] =
        "T.1000nm,S0.950nm,S0.1000nm,S1.950nm,albedo.R,albedo.G,albedo.B";
    char path[] = "/tmp/importonXXXXXX.exr";
    const int fd = mkstemps(path, 4);
    imp_film *film = NULL, *back = NULL;
    struct imp_write_options o = IMP_WRITE_OPTIONS_INIT;
    if (fd >= 0) close(fd);
    int bad = imp__film_create(ctx, 3, 2, list, true, &film) != IMP_OK;
    for (size_t i = 0; !bad && i < imp__film_values(film); i++) {
        film->mean[i] = (float)i + 0.25f;
        film->se[i] = 0.001f * (float)i;
    }
    o.standard_error = 1;
    bad = bad || imp_film_write(film, path, &o) != IMP_OK ||
          imp_film_read(ctx, path, &back) != IMP_OK;
    tap_ok(!bad && back->channels == 7, "written and read: no R, G, B came with it");
    int wrong = 0;
    for (int c = 0; !bad && c < 7; c++) {
        const int k = imp__film_find(back, film->names[c]);
        for (size_t i = 0; i < 6; i++)
            wrong += k < 0 ||
                     back->mean[7 * i + (size_t)k] != film->mean[7 * i + (size_t)c] ||
                     back->se[7 * i + (size_t)k] != film->se[7 * i + (size_t)c];
    }
    tap_ok(!bad && wrong == 0, "values and errors by name");
    tap_ok(!bad &&
               imp__film_find(back, "S0.1000nm") == imp__film_find(back, "S0.950nm") + 1,
           "in the order of wavelengths");
    unlink(path);
    imp_film_destroy(film);
    imp_film_destroy(back);
}

/* Names whose way into a file and back ends elsewhere, and errors of errors. */
static void odd_names(imp_context *ctx)
{
    static const char *const lists[] = {"S0.550.0nm,R", "S0.25.7142857nm,S0.1e-07nm",
                                        "R,se.R,se.se.R"};
    int wrong = 0;
    for (int k = 0; k < 3; k++) {
        char path[] = "/tmp/importonXXXXXX.exr";
        const int fd = mkstemps(path, 4);
        imp_film *film = NULL, *back = NULL;
        if (fd >= 0) close(fd);
        wrong += imp__film_create(ctx, 3, 2, lists[k], false, &film) != IMP_OK;
        for (size_t i = 0; film && i < imp__film_values(film); i++)
            film->mean[i] = (float)i + .5f;
        wrong += imp_film_write(film, path, NULL) != IMP_OK ||
                 imp_film_read(ctx, path, &back) != IMP_OK ||
                 back->channels != 2; /* of the third, se.R is the error of R */
        for (int i = 0; k < 2 && back && i < 12; i++)
            wrong += fmodf(back->mean[i], 1) != .5f;
        unlink(path);
        imp_film_destroy(film);
        imp_film_destroy(back);
    }
    tap_ok(wrong == 0, "odd names of channels # %d wrong", wrong);
}

/* Flat spectra of 47 channels of 10 nm. */
static void colours(imp_context *ctx)
{
    for (int reflects = 0; reflects < 2; reflects++) {
        char list[47 * 12] = "";
        size_t n = 0;
        for (int k = 0; k < 47; k++)
            n += (size_t)snprintf(list + n, sizeof list - n, "%s%s.%dnm", k ? "," : "",
                                  reflects ? "T" : "S0", 365 + 10 * k);
        imp_film *film = NULL, *rgb = NULL;
        double want[3] = {1, 1, 1}, worst = 1;
        if (!reflects) imp__xyz_to_rgb((double[3]){1, 1, 1}, want);
        if (imp__film_create(ctx, 1, 1, list, false, &film) == IMP_OK) {
            for (int k = 0; k < 47; k++) film->mean[k] = 1;
            if (imp__exr_spectral_rgb(film, &rgb) == IMP_OK && rgb) {
                worst = 0;
                for (int k = 0; k < 3; k++)
                    worst = fmax(worst, fabs((double)rgb->mean[k] - want[k]));
            }
        }
        tap_near(worst, 0, 0, 2e-3,
                 reflects ? "reflecting all is white" : "equal energy");
        imp_film_destroy(film);
        imp_film_destroy(rgb);
    }
    imp_film *film = NULL, *rgb = NULL;
    const bool good =
        imp__film_create(ctx, 1, 1, "R,G,B,S0.500nm", false, &film) == IMP_OK &&
        imp__exr_spectral_rgb(film, &rgb) == IMP_OK && !rgb;
    tap_ok(good, "colours that are there are kept");
    imp_film_destroy(film);
}

int main(void)
{
    imp_context *ctx = test_context(1);
    names();
    round_trip(ctx);
    odd_names(ctx);
    colours(ctx);
    imp_context_destroy(ctx);
    return tap_done();
}
