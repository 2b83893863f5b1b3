/* SPDX-License-Identifier: Apache-2.0
 *
 * importon: what lighting designers ask of a scene. Grids of illuminances with averages,
 * minima, maxima and uniformities, whose intervals hold for an extreme of noisy values, too;
 * the share of each lamp and surface in a reading; the photometry of luminaires.
 * docs/rooms.md. Same conventions as importon.h.
 */
#ifndef IMPORTON_ROOMS_H
#define IMPORTON_ROOMS_H

#include <importon/importon.h>
#include <importon/until.h>

#ifdef __cplusplus
extern "C" {
#endif

/* ---- Grids ------------------------------------------------------------------------ */

/**
 * The places that the pixels of an irradiancemeter stand for, or those that a radiancemeter with a
 * grid looks at: the middle of each one's cell.
 * @param sensor number of such a sensor.
 * @param[out] points  [height][width][3] of the crop window, scene units.
 * @param[out] normals [height][width][3] the normal of its shape there, unit; may be NULL.
 * @return IMP_OK; IMP_E_ARG if there is no such sensor, or it is no irradiancemeter on a
 *         rectangle or, at points, on a disk or a flat mesh, nor a radiancemeter with a grid.
 */
IMP_API IMP_MUST_CHECK enum imp_status imp_grid_points(const imp_scene *scene, int sensor,
                                                       double *points, double *normals);

/**
 * Where the points of imp_grid_points are in a raster of columns and rows: a rectangle's is its film, row
 * by row, in the directions of u and v. On a disk or a flat mesh the raster is that of the
 * rectangle around the shape, and the film has one row of those points that lie on the
 * shape.
 * @param sensor as imp_grid_points.
 * @param[out] columns [1] of the raster; may be NULL.
 * @param[out] rows    [1] may be NULL.
 * @param[out] cell    [height][width][2] of the crop window: column and row of each point, from 0;
 *                     may be NULL.
 * @return as imp_grid_points.
 */
IMP_API IMP_MUST_CHECK enum imp_status imp_grid_cells(const imp_scene *scene, int sensor,
                                                      int *columns, int *rows,
                                                      int32_t *cell);

/**
 * The readings of all pixels of a sensor, and their mean: luminance or illuminance of rgb and
 * mono scenes. With several colours in the film the error of a pixel is a bound, the sum
 * of the colours' errors by their weights; pixel format luminance has the error itself.
 * @param run      its sensor, end, seed and spp; NULL for defaults.
 * @param[out] value [height][width] of the crop window, in the sensor's unit.
 * @param[out] se    [height][width], one standard error each. Neighbours share what walks from the
 *                  sensor meet, and light walks reach many pixels: errors are not independent.
 * @param[out] average the mean of all, with its own error.
 * @param[out] sets  [1] independent sets of samples of a pixel from which the errors come, for
 *                   imp_grid_summarise; may be NULL.
 * @return IMP_OK; IMP_E_ARG; IMP_E_UNSUPPORTED for films of response curves or of XYZ, and
 *         filters wider than a pixel; what imp_render refuses; IMP_E_NOMEM.
 */
IMP_API IMP_MUST_CHECK enum imp_status
imp_grid_read(imp_scene *scene, const struct imp_run *run, double *value, double *se,
              struct imp_estimate *average, int64_t *sets);

/**
 * imp_grid_read until each point is known to a part `relative`: each reading lies within relative times
 * itself of the truth with probability 1 - risk (.95), each by itself. A pilot gives each
 * point the samples that it needs; the readings are of fresh samples alone, so that they are
 * unbiased, with honest errors (Stein 1945). Where a pilot finds no light a point has as many samples
 * as the largest number of any other.
 * @param run     run->spp: samples of a point in the first pilot, 0: 64; without
 *                time_limit_s.
 * @param options NULL for defaults; most_spp: of a point.
 * @param[out] value [height][width] of the crop window, in the sensor's unit.
 * @param[out] se    [height][width], one standard error each.
 * @param[out] average the mean of all, with its error.
 * @param[out] sets  [1] of the point with the fewest; may be NULL.
 * @param[out] end   spp: the mean over points, pilots included; looks: pilots, and the reading;
 *                   relative: the largest bound of a point that is not dark; may be NULL.
 * @return as imp_grid_read; IMP_E_UNSUPPORTED for walks from lights or from both ends, and
 *         integrators without walks.
 */
IMP_API IMP_MUST_CHECK enum imp_status
imp_grid_read_until(imp_scene *scene, const struct imp_run *run,
                    const struct imp_until_options *options, double *value, double *se,
                    struct imp_estimate *average, int64_t *sets,
                    struct imp_until_end *end);

/** A number, and an interval around what it estimates. */
struct imp_interval_estimate {
    double value, lo, hi;
};

struct imp_grid_summary {
    size_t size;
    size_t n; /**< points that counted */
    double
        confidence; /**< with which each interval by itself contains the truth, at least */
    struct imp_interval_estimate average, minimum, maximum;
    struct imp_interval_estimate
        uniformity;                         /**< minimum over average, U0 of EN 12464-1 */
    struct imp_interval_estimate diversity; /**< minimum over maximum, Ud */
    size_t at_minimum, at_maximum; /**< index of the least and the largest value */
};
#define IMP_GRID_SUMMARY_INIT IMP_INIT_ZERO(struct imp_grid_summary)

/**
 * Average, minimum, maximum and uniformities of a grid of noisy values, with intervals that
 * hold for any dependence between the values.
 *
 * The least of noisy values lies below the least true value on average, so an interval of that
 * value alone would not hold. With x_i and s_i of n points, and z(p) the normal (with `sets`,
 * Student's) quantile, the minimum m of the true values mu_i has
 *     P(m < min_i (x_i - z(1 - a) s_i)) <= a, as it is so for the point where m is taken;
 *     P(m > min_i (x_i + z(1 - a/n) s_i)) <= a, as m <= mu_i for all i (Bonferroni).
 * The second is conservative where few points are near the minimum. In place of z(1 - a/n) it has the
 * u for which  sum_i P(z > u + d_i) = a,  d_i = max(0, (x_i - min_j (x_j + 1.75 s_j))/s_i - 1.75):  points
 * that surely lie above the least one count less. Where all points are near it this is missed
 * with up to 2 a, but then the first bound hardly ever is: coverage is confidence or more, in
 * simulations of all kinds of grids. Ratios take bounds of both numbers, the risks added.
 * @param value   [n], finite.
 * @param se      [n], finite, not negative.
 * @param average as imp_grid_read gives it; NULL: the mean of value, whose errors are
 *                then taken as independent, which those of imp_grid_read are not.
 * @param sets    of imp_grid_read; below 2: errors are taken as exact.
 * @param confidence in (0, 1); 0: .95.
 * @param[out] out set out->size first.
 * @return IMP_OK; IMP_E_ARG for n = 0 or numbers out of their range.
 */
IMP_API IMP_MUST_CHECK enum imp_status
imp_grid_summarise(imp_context *context, size_t n, const double *value, const double *se,
                   const struct imp_estimate *average, int64_t sets, double confidence,
                   struct imp_grid_summary *out);

/* ---- Glare ------------------------------------------------------------------------ */

/** A luminaire as an observer sees it. */
struct imp_glare_source {
    double luminance;   /**< cd/m^2, towards the eye */
    double solid_angle; /**< sr, of its luminous parts */
    double position;    /**< Guth's index (imp_guth_position) */
};

/** Guth's position index p of a source above the line of sight, by the table of CIE 117-1995;
 * between its entries and beyond them it follows a formula (Levin 1975, J. Illum. Eng. Soc. 4,
 * 99), which alone would be up to 10 % less:
 *     ln p = (35.2 - .31889 a - 1.22 e^(-2 a/9)) b/1000 + (21 + .26667 a - .002963 a^2) b^2/1e5
 * @param a degrees from the vertical of the plane through the source and the line of
 *          sight, in [0, 90]: a source below counts as if it were above.
 * @param b degrees between the source and the line of sight, in [0, 90].
 * @return p >= 1; NAN for angles out of their range. */
IMP_API double imp_guth_position(double a, double b);

/** Unified glare rating, CIE 117-1995: 8 log10(.25/Lb sum L^2 w/p^2).
 * @param background Lb, cd/m^2, above 0: the indirect vertical illuminance at the eye over pi.
 * @param source [n] all above 0; may be NULL where n is 0.
 * @param[out] ugr [1] -INFINITY without sources.
 * @return IMP_OK; IMP_E_ARG. */
IMP_API IMP_MUST_CHECK enum imp_status imp_ugr(imp_context *context, double background,
                                               size_t n,
                                               const struct imp_glare_source *source,
                                               double *ugr);

/**
 * The glare rating at every point of a grid of vertical illuminances: an irradiancemeter whose
 * shape is virtual and horizontal, with the line of sight as its `facing`. Sources are the
 * scene's luminaires (emitters `ies`) that are before the observer and not hidden by a shape,
 * seen as a whole, each with the luminance I/A of its table and its luminous area (of its
 * shape, or of the file's opening for a point); all other light is background. Lb is
 * the grid's reading less the luminaires' direct part, over pi. Lengths are metres.
 * @param run      its sensor, end, seed and spp; NULL for defaults.
 * @param[out] ugr [height][width] of the crop window; -INFINITY where no source is seen.
 * @param[out] se  [height][width], one standard error each, that of Lb's; may be NULL.
 * @return as imp_grid_read; IMP_E_ARG for another sensor, or a luminaire without a
 *         luminous area; IMP_E_NUMERIC where the background is not above 0.
 */
IMP_API IMP_MUST_CHECK enum imp_status
imp_grid_glare(imp_scene *scene, const struct imp_run *run, double *ugr, double *se);

/** Position index below the line of sight (Iwata and Tokura 1997): 1 + .8 r for r = tan b up to .6,
 * 1 + 1.2 r beyond, with r at most 3.
 * @param b degrees between the source and the line of sight, in [0, 90].
 * @return at least 1; NAN for angles out of their range. */
IMP_API double imp_iwata_position(double b);

/** Daylight glare probability (Wienold and Christoffersen 2006):
 *     5.87e-5 E + .0918 log10(1 + sum L^2 w/(E^1.87 p^2)) + .16
 * which was found for E of 380 lx or more and for .2 to .8. Other values are given as the formula
 * has them, above 1, too.
 * @param illuminance E, lx, vertical at the eye; above 0 if there is a source, else at least 0.
 * @param source [n] none negative; may be NULL where n is 0.
 * @param[out] dgp [1]
 * @return IMP_OK; IMP_E_ARG. */
IMP_API IMP_MUST_CHECK enum imp_status imp_dgp(imp_context *context, double illuminance,
                                               size_t n,
                                               const struct imp_glare_source *source,
                                               double *dgp);

struct imp_dgp_options {
    size_t size;
    double threshold; /**< luminance from which a part of the view is a source: up to 100
                           a multiple of the mean luminance of the view, above that
                           cd/m^2; 0: 5 */
    int cells; /**< the view, half of all directions, has cells x cells parts of equal
                    solid angle; a multiple of 4, 8 to 512; 0: 64 */
};
#define IMP_DGP_OPTIONS_INIT IMP_INIT_ZERO(struct imp_dgp_options)

/**
 * The daylight glare probability at every point of a grid of vertical illuminances: an
 * irradiancemeter as for imp_grid_glare, `at` points. Sources are the cells of the view whose
 * luminance is above the threshold, each with its own position index (Guth's above the line of
 * sight and at most 16, Iwata's below); E is the grid's reading. All comes from the walks of
 * the meter, by the directions in which they leave the eye; in 16 groups, so that squares of
 * luminances are products of independent ones. Cells across the edge of a source are made up for
 * by those of twice their side (Richardson). A `sun` that light samples find is a source with the
 * size of its disc; the light of other sources smaller than a cell stays spread over the
 * cell.
 * @param run     its sensor, seed and spp, which is at least 16 walks for each cell; NULL for
 *                defaults. Walks are those from the sensor.
 * @param options NULL for defaults.
 * @param[out] dgp         [height][width] of the crop window.
 * @param[out] se          [height][width], one standard error each, with 15 degrees of freedom
 *                         (jackknife over the groups); may be NULL.
 * @param[out] illuminance [height][width], E, lx; may be NULL.
 * @return IMP_OK; IMP_E_ARG for another sensor or options out of their range;
 *         IMP_E_UNSUPPORTED for spectral modes, media, graded indices, hidden emitters and
 *         integrators whose walks do not begin at the sensor; IMP_CANCELLED; IMP_E_PATHS;
 *         IMP_E_NOMEM.
 */
IMP_API IMP_MUST_CHECK enum imp_status imp_grid_dgp(imp_scene *scene,
                                                    const struct imp_run *run,
                                                    const struct imp_dgp_options *options,
                                                    double *dgp, double *se,
                                                    double *illuminance);

/* ---- Daylight of a year --------------------------------------------------------------- */

/** The weather of an hour. */
struct imp_weather_hour {
    int year, month, day;
    double hour;   /**< its middle, 0.5 to 23.5 of the place's standard time */
    double sun[3]; /**< unit, towards it at that time: z up, x south, y west */
    double diffuse,
        direct; /**< irradiances of level ground by the sky, and across the sun's
                                 rays by the sun, W/m^2 */
    double diffuse_illuminance, direct_illuminance; /**< the same in lx */
};

struct imp_weather_info {
    size_t size;
    char place[64];             /**< as the file names it */
    double latitude, longitude; /**< degrees, north and east positive */
    double timezone;            /**< hours east of Greenwich */
    double elevation;           /**< m */
    size_t n;                   /**< hours: 8760, or 8784 */
    bool
        modelled; /**< illuminances are not the file's, which has none or none that can be:
                        they are made of irradiances and dew points (Perez et al. 1990) */
};
#define IMP_WEATHER_INFO_INIT IMP_INIT_ZERO(struct imp_weather_info)

/**
 * The hours of a year from an EnergyPlus weather file (EPW).
 * @param[out] info set info->size first.
 * @param[out] hour [room] the first of them; may be NULL where room is 0.
 * @return IMP_OK; IMP_E_IO; IMP_E_SCENE with file, line and column for what is damaged, has hours
 *         missing or no radiation in any, or lacks a radiation; IMP_E_NOMEM.
 */
IMP_API IMP_MUST_CHECK enum imp_status
imp_weather_read(imp_context *context, const char *path, struct imp_weather_info *info,
                 struct imp_weather_hour *hour, size_t room);

struct imp_annual_options {
    size_t size;
    double opens,
        closes;    /**< hours of use of every day, standard time; an hour counts whose
                               middle lies between. 0 and 0: 8 to 18 */
    double wanted; /**< lx, of the autonomy; 0: 300 */
    double useful
        [3]; /**< lx, ascending, between the four parts of useful daylight; all 0: 100,
                           300, 3000 */
    double sunlit;       /**< lx of the sun alone, which is too much; 0: 1000 */
    double sunlit_hours; /**< a year, so many of which are too much; 0: 250 */
    double part;         /**< of the hours, at which a point has daylight enough; 0: .5 */
};
#define IMP_ANNUAL_OPTIONS_INIT IMP_INIT_ZERO(struct imp_annual_options)

/** A year at a point. Errors are standard errors with 15 degrees of freedom. */
struct imp_annual_point {
    struct imp_estimate
        autonomy; /**< DA: part of the hours of use with `wanted` or more */
    struct imp_estimate continuous; /**< cDA: mean over them of min(E/wanted, 1) */
    struct imp_estimate
        useful[4];                /**< UDI: part of them below useful[0], below [1], up to
                                        [2], and above */
    struct imp_estimate mean;     /**< over the hours of use, lx */
    struct imp_estimate exposure; /**< over all hours, lx h */
    struct imp_estimate
        sunlit_hours; /**< hours of use with `sunlit` or more by the sun alone,
                                           not reflected */
};

struct imp_annual_summary {
    size_t size;
    size_t hours;                    /**< of use */
    struct imp_annual_point average; /**< over the points */
    struct imp_estimate
        spatial_autonomy; /**< sDA: part of the points with an autonomy of `part` or more */
    struct imp_estimate
        sun_exposure; /**< ASE: part of the points with more than `sunlit_hours` */
};
#define IMP_ANNUAL_SUMMARY_INIT IMP_INIT_ZERO(struct imp_annual_summary)

/**
 * Daylight at the points of an irradiancemeter over the hours of a year, from one set of walks.
 *
 * The scene has an emitter `perezsky` or `ciesky`, which says where up and south are, and how
 * directions into the sky are drawn; its own light does not count, nor does that of any other
 * emitter. The sky of an hour is Perez' (1993) with its diffuse illuminance, the sun a disc
 * of .004675 rad with its direct illuminance.
 *
 * Walks give the coefficient of each of 577 patches of the sky (Reinhart), and of the sun in
 * each patch that it passes, where it is reflected; what the sun gives a point at once is
 * computed for each hour by rays. Light of the sun passes panes (delta lobes that go straight
 * on). Errors: 16 groups of walks, and balanced halves of them (Walsh and Hadamard), which
 * hold for numbers that count hours, too.
 * @param run     its sensor, seed and spp, which is rounded up to a multiple of 16; NULL for
 *                defaults. Walks are those from the sensor.
 * @param hour    [n] irradiances at least 0; an hour with the sun below the horizon has no sun,
 *                and the sky of a sun that sets.
 * @param options NULL for defaults.
 * @param[out] point    [height][width] of the crop window; may be NULL.
 * @param[out] summary  set summary->size first; may be NULL.
 * @param[out] reading  [height][width][n] the hours' illuminances, lx; may be NULL.
 * @param[out] se       [height][width][n] one standard error each; may be NULL.
 * @return IMP_OK; IMP_E_ARG for another sensor, a scene without such a sky, hours without any
 *         light or numbers out of their range; IMP_E_UNSUPPORTED for spectral modes, media,
 *         graded indices and integrators whose walks do not begin at the sensor;
 *         IMP_CANCELLED; IMP_E_PATHS; IMP_E_NOMEM.
 */
IMP_API IMP_MUST_CHECK enum imp_status
imp_annual_read(imp_scene *scene, const struct imp_run *run, size_t n,
                const struct imp_weather_hour *hour,
                const struct imp_annual_options *options, struct imp_annual_point *point,
                struct imp_annual_summary *summary, double *reading, double *se);

/* ---- Luminaires -------------------------------------------------------------------- */

/** An emitter `ies` of a scene, with what its photometric file says. */
struct imp_luminaire_info {
    size_t size;
    const char *name; /**< of the emitter; belongs to the scene */
    double
        flux; /**< lm in operation: the table's integral times scale, dimming, maintenance and tilt */
    double lamp_flux; /**< lm of its lamps by the file; 0: not given */
    double watts;     /**< by the file, undimmed; 0: not given */
    double efficacy;  /**< lm/W of the luminaire as measured; 0: watts are not given */
    double dimming, maintenance;
    bool is_point;      /**< it is at the top of the scene, at `position`; else a shape */
    double position[3]; /**< scene units; of a shape: the middle of its box */
    double opening[3];  /**< luminous opening by the file, m: along C0, along C90, height;
                              a round one as the square of its area */
    double level; /**< dimming times the present scale (1 for a texture): 0 is off */
    double power; /**< W in operation: watts times level; 0: watts are not given */
    const char
        *file; /**< its photometric file as the scene names it; NULL: of none. Belongs
                           to the scene */
};

/** Number of luminaires; 0 for NULL. */
IMP_API int imp_scene_n_luminaires(const imp_scene *scene);
/** Set info->size first. @return IMP_OK; IMP_E_ARG if there is no such luminaire. */
IMP_API IMP_MUST_CHECK enum imp_status
imp_scene_get_luminaire(const imp_scene *scene, int luminaire,
                        struct imp_luminaire_info *info);

enum imp_glare_table_size {
    IMP_GLARE_ROOMS = 19, /**< of a table of glare ratings */
    IMP_GLARE_SETS = 5    /**< of reflectances */
};

struct imp_glare_table_options {
    size_t size;
    double
        spacing; /**< of the luminaires in parts of their height above the eyes; 0: .25, as in
                         most catalogues; CIE 190 has 1 */
    double flux; /**< lm of a luminaire in place of that which it has in the scene: tables
                         of catalogues are often for 1000 lm; 0: that of the scene */
};
#define IMP_GLARE_TABLE_OPTIONS_INIT IMP_INIT_ZERO(struct imp_glare_table_options)

/** Unified glare ratings of a luminaire in standard rooms. */
struct imp_glare_table {
    size_t size;
    double flux, spacing;
    double room[IMP_GLARE_ROOMS]
               [2]; /**< width across the line of sight and depth along it,
                         in heights of the luminaires above the eyes */
    double reflectance[IMP_GLARE_SETS][3];          /**< of ceiling, walls and floor */
    double ugr[IMP_GLARE_ROOMS][2][IMP_GLARE_SETS]; /**< seen across the length of
                                                       the lamps, and along it */
};
#define IMP_GLARE_TABLE_INIT IMP_INIT_ZERO(struct imp_glare_table)

/**
 * The table of glare ratings of a luminaire (CIE 117-1995, CIE 190:2010), from its photometric file:
 * an observer in the middle of a wall looks level along a room full of such luminaires.
 * Background is the walls' mean indirect illuminance over pi, by the exchange between
 * floor, walls and ceiling; luminaires count whose T/R is at most 3 and whose rays are
 * within 85 degrees of nadir, with their luminous openings by the file.
 * @param luminaire from 0 (imp_scene_get_luminaire).
 * @param options NULL for defaults.
 * @param[out] out set out->size first.
 * @return IMP_OK; IMP_E_ARG if there is no such luminaire, it is dark or its file names no
 *         opening, or options are out of their range.
 */
IMP_API IMP_MUST_CHECK enum imp_status
imp_luminaire_glare_table(const imp_scene *scene, int luminaire,
                          const struct imp_glare_table_options *options,
                          struct imp_glare_table *out);

/* ---- Shares of a reading ----------------------------------------------------------- */

enum imp_share_of {
    IMP_SHARE_LIGHT = 0,  /**< a light's emission */
    IMP_SHARE_SURFACE = 1 /**< a material's reflectances */
};

/** x dE/dx of a reading E, summed over the numbers x of one object: dE/d ln x by a common factor of
 * them. For a light it is what E has of it, and those of all lights add up to E, which is
 * of first degree in what they emit (Euler). For a material it is what E gains by a change of its
 * reflectances, as a part of them: E times the mean number of reflections by it. */
struct imp_share {
    enum imp_share_of of;
    const char *name; /**< of the object; belongs to the scene */
    double value, se; /**< in the unit of the reading */
};

/**
 * The reading of a sensor, the mean over its film, and what each light and each material has to do
 * with it, from one set of walks.
 * @param run      its sensor, end, seed and spp; NULL for defaults.
 * @param[out] share [room] lights in the scene's order, then materials that reflect; may be NULL
 *                   where room is 0. Objects that share a parameter are one row, by the
 *                   name of the first.
 * @param room     rows that there is room for.
 * @param[out] n   how many rows there are; more than room: nothing else is computed.
 * @param[out] reading may be NULL where room is 0.
 * @return IMP_OK; IMP_E_ARG; IMP_E_BIAS if a light's emission has no unbiased gradient, as then
 *         shares would not add up; what imp_problem_functional refuses; IMP_E_NOMEM.
 */
IMP_API IMP_MUST_CHECK enum imp_status
imp_reading_shares(imp_scene *scene, const struct imp_run *run, struct imp_share *share,
                   size_t room, size_t *n, struct imp_estimate *reading);

#ifdef __cplusplus
}
#endif

#endif
