/* SPDX-License-Identifier: Apache-2.0
 *
 * Vertices in lanes while they are made (lanes_vertex.c), and their records. */
#ifndef IMP_WALK_BUNDLE_LANES_RECORD_H
#define IMP_WALK_BUNDLE_LANES_RECORD_H

#include "lanes_light.h"

/* The vertices at work. */
struct imp_lanes_vertices {
    struct imp_wide_surface x;
    imp_wide3 wo, wo_drawn;        /* shading frame, as decided, and before */
    struct imp_wide_block numbers; /* of the walks' points, or of their keys */
    bool points, recorded;
    int depth;
    const struct imp_wide_color *in;
    const imp_spec
        *each; /* of materials without a kernel in place of `in`: those of lane k
                             begin at number k stride */
    int stride;
    unsigned on; /* a bit for each lane that counts */
    int at;      /* place of the first among the values of the depth */
    const int32_t *order;
    int32_t walk[IMP_WIDE_LANES];
    imp_wide3 faced; /* normals, where there is a tree of lights */
    struct imp_vertex *record[IMP_WIDE_LANES]; /* where they are recorded */
};

/* The wavelengths of the walk of lane k; NULL: colours. */
static inline const struct imp_carried *
imp__lanes_carried(const struct imp_bundle *b, const struct imp_lanes_vertices *v, int k)
{
    return b->waves ? &b->waves[v->walk[k]]->carried : NULL;
}

/* Their connections to lights. */
struct imp_lanes_lit {
    struct imp_lanes_light light;
    imp_wide3 wi; /* as decided */
    struct imp_wide_color f, brings;
    imp_wide weight;   /* as decided */
    unsigned on, dark; /* lanes that get light if it is seen; that would get none */
};

/* Their steps to the next vertices. */
struct imp_lanes_step {
    imp_wide3 wi, world; /* in the shading frame, as decided; as drawn */
    imp_wide pdf, survive, eta, scale;
    imp_wide_lobe lobe;
    struct imp_wide_color w, beta;
    unsigned on; /* lanes that go on */
    uint8_t zeros
        [IMP_WIDE_LANES]; /* of theirs, where walks are for derivatives (columns.h) */
};

/* Points and frames by the shapes' own functions; inputs that are not the constants bin->in, at each
 * walk's wavelengths or in colours (lanes_place.c). */
void imp__lanes_surface(const struct imp_depth *d, const struct imp_wide_hits *hits,
                        struct imp_wide_surface *out);
void imp__lanes_inputs(const struct imp_depth *d, const struct imp_bin *bin,
                       const struct imp_wide_hits *hits,
                       const struct imp_lanes_vertices *v, struct imp_wide_color *in);
/* The same of the lanes with bits, for materials without a kernel; each [lanes n_in]. */
void imp__lanes_inputs_each(const struct imp_depth *d, const struct imp_bin *bin,
                            const struct imp_wide_hits *hits,
                            const struct imp_lanes_vertices *v, imp_spec *each);

/* ---- lanes_spectra.c ---- */
/* Before n vertices are made, in spectra: what they look up. */
void imp__lanes_spectra_keep(struct imp_bundle *b, const struct imp_bin *bin, int n);
/* s at the wavelengths of the walks of v with bits. */
void imp__lanes_spectrum(const struct imp_bundle *b, const struct imp_spectrum *s,
                         const struct imp_lanes_vertices *v, unsigned bits,
                         struct imp_wide_color *out);

/* What kernels of struct imp_bsdf_lanes do, for materials without one: for the lanes that count, or
 * those with bits, where a density is wanted (lone_kernel.c). */
imp_wide_truth imp__lone_sample(const struct imp_bin *bin,
                                const struct imp_lanes_vertices *v, const imp_wide u[3],
                                imp_wide3 *wi, imp_wide_lobe *lobe);
imp_wide imp__lone_pdf_eval(const struct imp_bin *bin, const struct imp_lanes_vertices *v,
                            const imp_wide3 *wo, const imp_wide3 *wi,
                            const imp_wide_lobe *lobe, unsigned bits,
                            struct imp_wide_color *f);
imp_wide imp__lone_index_ratio(const struct imp_bin *bin,
                               const struct imp_lanes_vertices *v, const imp_wide3 *wo,
                               const imp_wide3 *wi, const imp_wide_lobe *lobe,
                               unsigned bits);

/* In media (media_collisions.c): places of collisions, whose frames have the axes of the world; what
 * shadow ray i, and the next ray, number i, of vertex k have besides. */
void imp__collision_places(const struct imp_depth *d, const int32_t *order,
                           struct imp_wide_surface *out);
void imp__shadow_in_media(struct imp_depth *d, const struct imp_bin *bin,
                          const struct imp_lanes_vertices *v, int k, int i);
void imp__ray_in_media(struct imp_depth *d, const struct imp_bin *bin,
                       const struct imp_lanes_vertices *v, int k, int i);

/* Where walks have derivatives: is there a lane with a value that is zero but has one? Then they are to
 * be made one by one. */
bool imp__lanes_differ(const struct imp_depth *d, const struct imp_bin *bin,
                       const struct imp_lanes_lit *lit);

/* Records them, into v->record. */
void imp__lanes_record(struct imp_depth *d, const struct imp_bin *bin,
                       struct imp_lanes_vertices *v, struct imp_lanes_lit *lit,
                       struct imp_lanes_step *step);

/* The sky that the rays order[n] of directions wi meet, with these MIS weights. */
void imp__lanes_record_sky(struct imp_depth *d, const int32_t *order, int n, int light,
                           const imp_wide3 *wi, const imp_wide *weight,
                           const struct imp_wide_color *met);

#endif
