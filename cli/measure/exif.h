/* SPDX-License-Identifier: Apache-2.0
 *
 * What a camera wrote into its file about how it took the picture (EXIF 2.3). */
#ifndef IMP_CLI_EXIF_H
#define IMP_CLI_EXIF_H

#include <stdbool.h>

/* 0: the file does not say, or what it says is no positive number. */
struct exif_numbers {
    double focal_35mm; /* mm, of a film of 36 x 24 with the same view */
    double exposure_s, iso, f_number;
};
/* Reads a JPEG file, or the chunk eXIf of a PNG file. What is damaged is as good as not there. */
struct exif_numbers exif_read(const char *path);
/* Was this program built with libexif? */
bool exif_is_built(void);

#endif
