/* SPDX-License-Identifier: Apache-2.0
 *
 * Walks in bundles: those of a few pixels of a picture go together, one segment at a time. Each
 * has the value, and the record if it is recorded, that it has alone (walk.h, imp__walk_trace), to
 * the bit, where points of a grid do not share (reuse.h); together they take less time, since kinds whose formulas are texts in lanes work on
 * several at once.
 *
 * A bundle begins in bundle.c. Vertices are made in lanes (lanes_vertex.c), where kinds without such
 * a text are called lane by lane; those on lights, and few on a shape, are made one by one by the
 * step of walks that go alone (alone_vertex.c). */
#ifndef IMP_WALK_BUNDLE_H
#define IMP_WALK_BUNDLE_H

#include "walk/core/walk.h"

/* The walks of such a tracer can be bundled. */
bool imp__bundle_fits(const struct imp_tracer *tracer);
/* And its points can share what they meet first (reuse.h), so many of them. */
enum { IMP_REUSE_MOST = 8 };
bool imp__reuse_fits(const struct imp_tracer *tracer);
/* The tracer if its walks can be bundled, and take less time so: where a register holds two
 * doubles they take more. Else NULL. */
static inline const struct imp_tracer *imp__bundle_use(const struct imp_tracer *tracer)
{
#if defined(__AVX2__)
    return imp__bundle_fits(tracer) ? tracer : NULL;
#else
    (void)tracer;
    return NULL;
#endif
}

/* Values of a spectrum at the wavelengths of all walks. */
struct imp_spectrum_kept {
    const struct imp_spectrum *of;
    imp_spec *row;
};
enum { IMP_SPECTRA_KEPT = 6 };

struct imp_swept;
struct imp_bundle {
    const struct imp_tracer *tracer;
    int n, n_samples; /* in all, of each pixel */
    int all;          /* with those that give only (near_walls.h), which follow */
    int colors;       /* 3, or the 4 wavelengths that each walk carries */
    const struct imp_waves **waves; /* of each walk; NULL: colours */
    struct imp_arena *arena;
    struct imp_spectrum_kept kept[IMP_SPECTRA_KEPT]; /* (lanes_spectra.c) */
    int n_kept;
    int before; /* vertices before the first one that a ray leads to */
    /* Each walk has: film position, time, its random numbers. */
    double *px, *py, *time;
    uint64_t *set; /* hash of the set, or the key of a walk of no set */
    uint32_t *index;
    uint64_t *
        keys; /* in media: its key, also of a point in a set; and the colour that draws */
    double *drew;
    /* Results. Where the tracer wants values only: radiance at the sensor; is alpha 1; why it was
     * dropped (enum imp_drop). */
    double *L[4];
    double *alone[4]; /* where points share: what L is without that */
    bool *valid;
    uint8_t *dropped;
    struct imp_walk *walks;  /* [n] records; NULL: values only, or what is swept */
    struct imp_swept *swept; /* swept.h; NULL: records, or values only */
};

/* The walks with the given numbers [n_samples] of each of the pixels xy [n_pixels], pixel by pixel.
 * *out lives as long as what is in the arena. False: no memory. */
bool imp__bundle_trace(const struct imp_tracer *tracer, struct imp_arena *arena,
                       int n_pixels, const int (*xy)[2], int n_samples,
                       const int64_t *samples, struct imp_bundle *out);

/* Walk k of a bundle, with its values at the sensor. */
void imp__bundle_walk(const struct imp_bundle *bundle, int k, struct imp_walk *walk);

#endif
