/* SPDX-License-Identifier: Apache-2.0
 *
 * Measured materials of the RGL database (Dupuy and Jakob 2018): tensor files with the
 * fields description, jacobian, theta_i, phi_i, sigma, ndf, vndf, luminance, and rgb, or
 * wavelengths and spectra, or both. */
#ifndef IMP_FORMAT_MEASURED_FILE_H
#define IMP_FORMAT_MEASURED_FILE_H

#include "base/file.h"
#include "base/props.h"
#include "tensor_file.h"

/* The tables live in `keep`. IMP_E_SCENE: not such a file; file, field and what is wrong. */
enum imp_status imp__measured_parse(imp_context *ctx, struct imp_arena *keep,
                                    const char *name, const struct imp_bytes *file,
                                    struct imp_measured_data *out);

#endif
