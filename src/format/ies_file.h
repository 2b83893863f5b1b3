/* SPDX-License-Identifier: Apache-2.0
 *
 * Photometry of luminaires: IESNA LM-63 of 1986, 1991, 1995, 2002 and 2019. */
#ifndef IMP_FORMAT_IES_FILE_H
#define IMP_FORMAT_IES_FILE_H

#include "base/file.h"
#include "base/props.h"

#define IMP_IES_BYTES_MAX  ((size_t)1 << 26)
#define IMP_IES_ANGLES_MAX 36001 /* of each kind */
#define IMP_IES_OFF_MAX    0.1   /* of flux, output ratio and table, before a warning */

/* The table in `text`, which is zero-terminated; `name` is for messages, what is kept
 * goes to the arena. Every number of the answer is finite, angles ascend and lie in
 * [0, 360] degrees ([-90, 90] with types A and B), and candela are >= 0, all of the file's factors included.
 * @return IMP_E_SCENE with file and line; IMP_E_NOMEM. */
enum imp_status imp__ies_parse(imp_context *ctx, struct imp_arena *keep, const char *name,
                               const struct imp_bytes *text, struct imp_ies_data *out);
/* The same of the file that TILT= named: into n_tilts, tilt and tilt_factor of *data. */
enum imp_status imp__ies_tilt_parse(imp_context *ctx, struct imp_arena *keep,
                                    const char *name, const struct imp_bytes *text,
                                    struct imp_ies_data *data);
/* Are its angles, by its type, such as a file may have? */
bool imp__ies_is_valid(const struct imp_ies_data *d);

#endif
