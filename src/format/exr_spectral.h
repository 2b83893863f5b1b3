/* SPDX-License-Identifier: Apache-2.0
 *
 * Spectral pictures in EXR files (Fichet, Pacanowski and Wilkie, "An OpenEXR Layout for
 * Spectral Images", JCGT 10(3), 2021): a channel is named by its Stokes component S0 to
 * S3, or T for what reflects or transmits, and its wavelength with a decimal comma, as in
 * S0.550,500000nm. Films write it with a point, S0.550.5nm, since commas part their names.
 * Standard errors are the channels se.S0.550,500000nm, which readers of the layout skip. */
#ifndef IMP_FORMAT_EXR_SPECTRAL_H
#define IMP_FORMAT_EXR_SPECTRAL_H

#include "base/film.h"

#define IMP_EXR_NAME_ROOM 256

/* The wavelength of a film's channel in nm; 0: it is no spectral channel. `emissive`, where
 * not NULL: whether it is one of S0 to S3. */
double imp__exr_wavelength(const char *name, bool *emissive);
/* A film's name as files have it, and back. Other names stay as they are. */
void imp__exr_name_to_file(const char *name, char text[IMP_EXR_NAME_ROOM]);
void imp__exr_name_to_film(const char *name, char text[IMP_EXR_NAME_ROOM]);

/* The picture in linear sRGB, channels R, G, B without errors: of light (S0) as it is, of
 * what reflects (T) in daylight. A channel covers the wavelengths that are nearest to
 * its own. *out is NULL of films that are not spectral, or have an R of their own. */
enum imp_status imp__exr_spectral_rgb(const imp_film *film, imp_film **out);

/* Text of files whose channels R, G, B are made from the spectrum: readers of ours skip
 * them. */
#define IMP_EXR_RGB_OF "importon.rgb"

#endif
