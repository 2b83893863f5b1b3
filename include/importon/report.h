/* SPDX-License-Identifier: Apache-2.0
 *
 * A result as one HTML page that opens anywhere: pictures with their errors, parameters
 * with their intervals, losses, checks, and how they were made. The page holds its data
 * as JSON (docs/report.md describes it, version 2), needs no network, and loads nothing.
 * Same conventions as importon.h.
 */
#ifndef IMPORTON_REPORT_H
#define IMPORTON_REPORT_H

#include <importon/importon.h>

#ifdef __cplusplus
extern "C" {
#endif

/** One part of a report: a picture (`film` is set), a JSON value (`json`) or the bytes of
 * a file that browsers draw (`image`). */
struct imp_report_item {
    size_t size;
    const char *kind; /**< "picture", or "derivative": signed, of a parameter; "fit",
                           "check", ...: the JSON that these commands write; "image".
                           Of others the page lists the values */
    const char *name; /**< what a reader sees; NULL: none */
    const char *role; /**< of pictures: "target" or "picture", which the page compares;
                           NULL: neither */
    const char *unit; /**< of pictures; NULL: none */
    int view;         /**< of pictures: those of one view are flipped in place */
    const imp_film *film; /**< its means, and its standard errors if it has them */
    const char *json;     /**< one JSON value (RFC 8259), UTF-8 */
    const void *image;    /**< [image_size] a PNG or SVG file */
    size_t image_size;
};
#define IMP_REPORT_ITEM_INIT IMP_INIT_ZERO(struct imp_report_item)

struct imp_report {
    size_t size;
    const char *title;   /**< NULL: "importon report" */
    const char *command; /**< that made the result, to be copied; NULL: not known */
    const struct imp_report_item *items; /**< [n_items]; all are copied into the page */
    size_t n_items;
    /** The page is served, and updated while work goes on (docs/report.md, section 5).
     * false: it may use no network. */
    bool live;
};
#define IMP_REPORT_INIT IMP_INIT_ZERO(struct imp_report)

/** Write the page; it appears whole or not at all. Pictures are stored as 16-bit floats,
 * scaled by a power of two to their largest value: 11 significant bits, 8/3 bytes a
 * number. Texts are shown as text whatever they contain.
 * @return IMP_OK; IMP_E_ARG for an item without a kind, or without exactly one of film,
 *         json and image, or JSON that does not parse (the message has its offset);
 *         IMP_E_IO; IMP_E_NOMEM. */
IMP_API IMP_MUST_CHECK enum imp_status
imp_report_write(imp_context *context, const struct imp_report *report, const char *path);

/** The same page in memory, for servers; and its data alone, the JSON inside the
 * page. The caller frees *text, which ends with a zero, with imp_free.
 * @param[out] length without that zero; may be NULL.
 * @return as imp_report_write. */
IMP_API IMP_MUST_CHECK enum imp_status imp_report_page(imp_context *context,
                                                       const struct imp_report *report,
                                                       char **text, size_t *length);
/** The data of the page alone, the JSON inside it.
 * @param[out] text to be freed with imp_free; length without the final zero, may be
 * NULL.
 * @return as imp_report_write. */
IMP_API IMP_MUST_CHECK enum imp_status imp_report_data(imp_context *context,
                                                       const struct imp_report *report,
                                                       char **text, size_t *length);

/* ---- What carried a pixel --------------------------------------------------------- */

/**
 * What parameters do to one pixel, over its own walks: shares x dR/dx / R, summed over
 * the numbers of a parameter, of R, the mean over channels of the radiance of the walks
 * that start in the pixel. Those of all emission add up to 1, where it is all active;
 * that of a reflectance is the mean number of reflections by it, weighted by what they
 * carry.
 * @param run      its sensor, seed and spp; NULL for defaults.
 * @param[out] share      [imp_scene_n_params]; 0: not active, or a black
 *                        pixel.
 * @param[out] share_se   [imp_scene_n_params], one standard error.
 * @param[out] radiance   R.
 * @param[out] walk_share [n_walks][imp_scene_n_params] x dL/dx of the pixel's first walks
 *                        (those of imp_walk_describe in their order, with IMP_POINTS_SOBOL those of
 *                        the first sets), in units of radiance; may be NULL
 *                        for no walks.
 * @return IMP_OK; IMP_E_ARG without an active parameter, for a pixel that is not there,
 *         or more walks than run->spp; what imp_problem_reverse refuses; IMP_E_NOMEM.
 */
IMP_API IMP_MUST_CHECK enum imp_status
imp_problem_shares(imp_problem *problem, const struct imp_run *run, int x, int y,
                   double *share, double *share_se, struct imp_estimate *radiance,
                   double *walk_share, int64_t n_walks);

#ifdef __cplusplus
}
#endif

#endif
