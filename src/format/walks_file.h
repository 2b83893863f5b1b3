/* SPDX-License-Identifier: Apache-2.0
 *
 * Recorded walks in a file: a head, the scene without its geometry (tree_file.h), the
 * values at which they were drawn, a checksum of these; then for each sensor a head and
 * the records of its tiles (walk/kept/record_file.c), each with a checksum of its own. */
#ifndef IMP_FORMAT_WALKS_FILE_H
#define IMP_FORMAT_WALKS_FILE_H

#include "inverse/estimate/walks_make.h"
#include "scene/fingerprint.h"
#include "tree_file.h"

#define IMP_WALKS_MAGIC      "impdrawn"
#define IMP_WALKS_BYTE_ORDER 0x01020304u
#define IMP_WALKS_VERSION    5

struct imp_walks_head {
    char magic[8];
    uint32_t byte_order, version;
    uint64_t scene_bytes, n_theta;
    uint64_t evaluated; /* imp__fingerprint_evaluated */
    uint64_t seed;
    int32_t spp, points, wavelengths, wavelength_set, losses, n_stores, guided, reserved;
    double survival, ess, headroom;
};
_Static_assert(sizeof(struct imp_walks_head) == 104, "no padding: it is written");

struct imp_walks_store_head {
    struct imp_record_of of;
    int32_t index, roulette;
};
_Static_assert(sizeof(struct imp_walks_store_head) == 40, "no padding: it is written");

/* Texels and cells are in the scene's bytes. */
static inline bool imp__walks_is_number(const struct imp_param *p)
{
    return p->store != IMP_STORE_BULK;
}
/* All values of the scene, theta [n_theta]; and those of theta that are not texels. */
void imp__walks_theta_get(const struct imp_scene *scene, double *theta);
void imp__walks_theta_set(struct imp_scene *scene, const double *theta);

#endif
