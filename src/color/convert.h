/* SPDX-License-Identifier: Apache-2.0
 *
 * From a colour as written to the numbers of a parameter. What a colour turns into
 * depends on how it was written and on what it is for (docs/scene-format.md 2.1); how
 * many numbers the parameter has depends on both too (12.2). */
#ifndef IMP_COLOR_CONVERT_H
#define IMP_COLOR_CONVERT_H

#include "spectrum.h"

#include "base/props.h"
#include <importon/kinds.h>

/* A request for a colour. */
struct imp__color_ask {
    imp_context *ctx;
    struct imp_arena *arena; /* for spectra */
    enum imp_color_mode mode;
    enum imp_role role;
    bool scalar; /* one number of a colour: the mean of the three, in mono mode the
                    luminance */
    /* Colours above 1 are lifted as they are, of a role that is no light. */
    bool any_size;
    bool linear; /* colours are lifted by the linear basis */
};

/* What it turns into. In spectral modes `value` is the colour in rgb, for what needs no
 * wavelengths, and `spectrum` what walks look up, with numbers of its own; NULL: value, at
 * all wavelengths. */
struct imp__color {
    imp_spec value;  /* in all lanes */
    int count;       /* 1: one number, the same in all lanes, or 3: r, g, b */
    const char *key; /* name of its parameter below the property's: "value" */
    struct imp_spectrum *spectrum;
};

static inline bool imp__is_spectral(enum imp_color_mode mode)
{
    return mode == IMP_SPECTRAL || mode == IMP_SINGLE;
}

/* @return IMP_OK, or IMP_E_SCENE with the place: not a colour, not finite, a reflectance
 * outside [0,1], negative light. */
enum imp_status imp__color_convert(const struct imp__color_ask *ask,
                                   const struct imp_node *node,
                                   const struct imp_prop *prop, struct imp__color *out);

/* Value of an absent property. */
enum imp_status imp__color_default(const struct imp__color_ask *ask, double fallback,
                                   struct imp__color *out);

/* Is this node a colour that is written as an object (uniform, srgb, d65, ...)? */
bool imp__color_is_object(const struct imp_node *node);
/* Does it have three numbers that may be a direction, rawconstant or srgb? */
bool imp__color_is_raw(const struct imp_node *node);
/* The property that has the numbers of such an object; NULL: none is written. */
const struct imp_prop *imp__color_written(const struct imp_node *node);
/* The same for such a node (docs/scene-format.md 2.4). Reads and checks all its
 * properties. */
enum imp_status imp__color_object(const struct imp__color_ask *ask, struct imp_node *node,
                                  struct imp__color *out);

/* The colour in rgb of a spectrum whose numbers have changed; its mean if `scalar`. */
void imp__color_preview(const struct imp_spectrum *s, enum imp_role role, bool scalar,
                        imp_spec *value);

#endif
