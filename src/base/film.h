/* SPDX-License-Identifier: Apache-2.0
 *
 * A picture: means and their standard errors, [height][width][channels], row 0 at the
 * top. Renders make it, format/film_file.c reads and writes it. */
#ifndef IMP_BASE_FILM_H
#define IMP_BASE_FILM_H

#include "drops.h"

#define IMP_FILM_SIDE_MAX     (1 << 20) /* pixels along one side */
#define IMP_FILM_CHANNELS_MAX 1024
#define IMP_FILM_VALUES_MAX   ((size_t)1 << 32)

struct imp_film {
    imp_context *ctx;
    int width, height, channels;
    char **names; /* [channels], as in EXR files */
    float *mean;
    float *se; /* one standard error of each mean; NULL: there are none */
    int64_t spp;
    int64_t sets;     /* of a pixel, whose spread its errors come from; 0: its samples' */
    uint64_t dropped; /* walks that count as 0, in a picture read from a file too */
    struct imp_drops drops; /* the same by cause, of a picture made here */
    size_t n_texts, cap_texts;
    struct imp_film_text {
        char *key, *value;
    } * texts; /* attributes of EXR files */
};

/* Zeros. `names` is a comma-separated list, one name a channel ("R,G,B"). */
enum imp_status imp__film_create(imp_context *ctx, int width, int height,
                                 const char *names, bool with_se, imp_film **out);
/* The same without mean and se, and the room for one of them, not cleared. */
enum imp_status imp__film_describe(imp_context *ctx, int width, int height,
                                   const char *names, imp_film **out);
enum imp_status imp__film_room(imp_film *film, float **array);
static inline size_t imp__film_values(const imp_film *f)
{
    return (size_t)f->width * (size_t)f->height * (size_t)f->channels;
}
/* Index of the channel with this name, -1: none. */
int imp__film_find(const imp_film *film, const char *name);

#endif
