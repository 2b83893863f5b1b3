/* SPDX-License-Identifier: Apache-2.0
 *
 * Pictures in and out: targets, masks, EXR files with the command that made them, and the
 * PNG previews beside them. */
#ifndef IMP_CLI_CMD_PICTURE_H
#define IMP_CLI_CMD_PICTURE_H

#include <importon/importon.h>
#include <stdio.h>

/* Read a picture; "-" is stdin (EXR). 0, or an exit code with the reason printed. */
int picture_read(const char *path, imp_film **out);

/* As a shell reads it: in quotes where that is needed. */
void quote_word(FILE *f, const char *word);
/* Record command line, version, seed, spp and time in the film. */
void picture_stamp(imp_film *film, const struct imp_run *run);

/* Text of pictures whose layers are other pictures' too. */
#define PICTURE_LAYERS "importon.layers"

struct picture_options {
    int standard_error;
    int half;
    int diverging; /* preview of a signed picture */
    int no_preview;
    double exposure;
    double range; /* of a signed preview: what is full red; 0: picture_range */
};
/* Write `path` ("-": EXR to stdout) and, unless it is a PNG itself, a PNG beside it. */
int picture_write(const imp_film *film, const char *path,
                  const struct picture_options *o);

/* N of "FILE@N"; -1: none is named. */
int picture_sensor(const char *spec);

/* The value of full red in a signed picture's preview: 99.5 % of the pixels are below. */
double picture_range(imp_film *film);

/* Weights of R, G and B in the luminance [3]. */
extern const double *const picture_luminance;

/* A target for a loss: "FILE[@N]", with an optional mask file (NULL: none), or "=V[@N]",
 * the reading of a sensor of one pixel. Without @N
 * the caller sets target->sensor. Pixels are brought to the scene's channels: its R, G,
 * B, or its Y, or in mono mode their luminance. target->pixels, weights and noise_se are
 * to be freed. */
int picture_target(const char *spec, const char *mask, struct imp_target *target);
void picture_target_free(struct imp_target *target);

/* May picture_write write `path` and, if wanted, the preview beside it? Called before hours
 * of work. 0, or an exit code with the reason printed. */
int picture_writable(const char *path, int preview);
/* It and its preview, if they are there. */
void picture_remove(const char *path);

/* Make the folder `path` and what is missing above it. */
int make_folder(const char *path);
/* A parameter's name as a file name: ids may hold '/' and lead out of the folder. In
 * place. */
void make_file_name(char *name);
/* "folder/name" in a new string. */
char *join_path(const char *folder, const char *name);

#endif
