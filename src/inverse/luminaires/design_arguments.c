/* SPDX-License-Identifier: Apache-2.0
 *
 * Lamps, wants and options of a design: defaults, and what is refused by name. */
#include "base/arguments.h"
#include "designing.h"
#include "kind/sensor/receiver.h"
#include <importon/plan.h>
#include <importon/rooms.h>
#include <math.h>
#include <string.h>

#define LAMPS_MAX 1000

static const char *const want_words[] = {"average", "minimum", "maximum", "uniformity",
                                         "UGR"};

static enum imp_status lamp_check(struct imp__design_model *m, size_t i)
{
    struct imp_design_lamp *l = &m->lamp[i];
    IMP_REQUIRE(m->ctx, l->lamp, "lamps: lamp");
    m->emitter[i] = -1;
    for (int e = 0; e < m->scene->n_emitters; e++)
        if (!strcmp(m->scene->emitters[e]->name, l->lamp)) m->emitter[i] = e;
    if (m->emitter[i] < 0)
        return imp__error(m->ctx, IMP_E_ARG, "lamps[%zu]: there is no lamp '%s'", i,
                          l->lamp);
    for (size_t k = 0; k < i; k++)
        if (m->emitter[k] == m->emitter[i])
            return imp__error(m->ctx, IMP_E_ARG, "lamps[%zu]: lamp '%s' is there twice",
                              i, l->lamp);
    if (m->scene->emitters[m->emitter[i]]->course)
        return imp__error(m->ctx, IMP_E_UNSUPPORTED,
                          "lamp '%s' varies in time: it has no one level", l->lamp);
    const double number[] = {l->watts, l->cost, l->least, l->most};
    const char *const name[] = {"watts", "cost", "least", "most"};
    for (int k = 0; k < 4; k++)
        if (!(number[k] >= 0 && number[k] < 1e12))
            return imp__error(m->ctx, IMP_E_ARG,
                              "lamp '%s': %s = %g is not a number >= 0", l->lamp, name[k],
                              number[k]);
    if (l->most == 0) l->most = 1;
    if (l->least == 0) l->least = fmin(0.1, l->most);
    if (!(l->least <= l->most && l->most <= 1))
        return imp__error(m->ctx, IMP_E_ARG,
                          "lamp '%s': levels from %g to %g; they are in (0, 1], the "
                          "least one first",
                          l->lamp, l->least, l->most);
    return IMP_OK;
}

/* Watts and flux of the photometric file. */
static void photometry_take(struct imp__design_model *m, size_t i)
{
    m->watts[i] = m->lamp[i].watts;
    m->flux[i] = 0;
    for (int k = 0; k < imp_scene_n_luminaires(m->scene); k++) {
        struct imp_luminaire_info info = {.size = sizeof info};
        if (imp_scene_get_luminaire(m->scene, k, &info) != IMP_OK ||
            strcmp(info.name, m->lamp[i].lamp) != 0)
            continue;
        if (m->watts[i] == 0) m->watts[i] = info.power;
        m->flux[i] = info.flux;
    }
}

static void place_find(struct imp__design_model *m, size_t i)
{
    const char *place = m->lamp[i].place;
    m->place[i] = m->n_places;
    for (size_t k = 0; k < i && place; k++)
        if (m->lamp[k].place && !strcmp(m->lamp[k].place, place))
            m->place[i] = m->place[k];
    m->n_places += m->place[i] == m->n_places;
    m->needed[m->place[i]] |= m->lamp[i].needed;
}

enum imp_status imp__design_lamps_take(struct imp__design_model *m,
                                       const struct imp_design_lamp *lamps)
{
    double costs = 0;
    if (m->n == 0 || m->n > LAMPS_MAX)
        return imp__error(m->ctx, IMP_E_ARG, "%zu lamps; a design takes 1 to %d", m->n,
                          LAMPS_MAX);
    m->lamp = imp__arena_array(m->arena, m->n, sizeof *m->lamp);
    m->emitter = imp__arena_array(m->arena, m->n, sizeof *m->emitter);
    m->watts = imp__arena_array(m->arena, 2 * m->n, sizeof *m->watts);
    m->place = imp__arena_array(m->arena, m->n, sizeof *m->place);
    m->needed = imp__arena_array(m->arena, m->n + 1, sizeof *m->needed);
    if (!m->lamp || !m->emitter || !m->watts || !m->place || !m->needed)
        return imp__error(m->ctx, IMP_E_NOMEM, "no memory for %zu lamps", m->n);
    m->flux = m->watts + m->n;
    for (size_t i = 0; i < m->n; i++) {
        m->lamp[i] = (struct imp_design_lamp)IMP_DESIGN_LAMP_INIT;
        IMP_CHECKED(imp__element_take(m->ctx, "imp_design_find", "lamps", lamps, i,
                                      &m->lamp[i], sizeof *m->lamp));
        IMP_CHECKED(lamp_check(m, i));
        photometry_take(m, i);
        place_find(m, i);
        if (m->o.least == IMP_LEAST_WATTS && !(m->watts[i] > 0))
            return imp__error(m->ctx, IMP_E_ARG,
                              "lamp '%s' has no watts: its file gives none",
                              m->lamp[i].lamp);
        if (m->o.least == IMP_LEAST_FLUX && !(m->flux[i] > 0))
            return imp__error(m->ctx, IMP_E_ARG,
                              "lamp '%s' has no flux: it is no luminaire (ies)",
                              m->lamp[i].lamp);
        costs += m->lamp[i].cost;
    }
    if (m->o.least == IMP_LEAST_COST && costs == 0)
        return imp__error(m->ctx, IMP_E_ARG, "lamps: none has a cost");
    return IMP_OK;
}

static enum imp_status want_check(struct imp__design_model *m, size_t i)
{
    const struct imp_design_want *w = &m->want[i];
    const struct imp_scene *scene = m->scene;
    if ((unsigned)w->of > IMP_WANT_UGR)
        return imp__error(m->ctx, IMP_E_ARG, "wants[%zu]: of = %d does not exist", i,
                          (int)w->of);
    if (w->sensor < 0 || w->sensor >= scene->n_sensors)
        return imp__error(m->ctx, IMP_E_ARG,
                          "wants[%zu]: there is no sensor %d; the scene has %d", i,
                          w->sensor, scene->n_sensors);
    const struct imp_sensor *s = scene->sensors[w->sensor];
    IMP_FINITE(m->ctx, w->value, "wants: value");
    const bool good = w->of == IMP_WANT_UNIFORMITY ? w->value > 0 && w->value < 1
                      : w->of == IMP_WANT_UGR      ? w->value >= 1 && w->value <= 60
                                                   : w->value > 0;
    if (!good)
        return imp__error(m->ctx, IMP_E_ARG, "sensor '%s': %s %g is not %s", s->name,
                          want_words[w->of], w->value,
                          w->of == IMP_WANT_UNIFORMITY ? "in (0, 1)"
                          : w->of == IMP_WANT_UGR      ? "in [1, 60]"
                                                       : "above 0");
    if (!s->receiver)
        return imp__error(m->ctx, IMP_E_ARG,
                          "sensor '%s' (%s) has no grid that a design reads: that is an "
                          "irradiancemeter on a rectangle, with 'virtual' true or 'at' "
                          "points",
                          s->name, s->ops->name);
    if (m->run.spp == 1 || (m->run.spp == 0 && s->spp == 1))
        return imp__error(m->ctx, IMP_E_ARG,
                          "spp = 1: one sample has no standard error, and a design needs "
                          "those of sensor '%s'",
                          s->name);
    if (w->of == IMP_WANT_UGR) IMP_CHECKED(imp__glare_sight_check(scene, s));
    for (size_t k = 0; k < i; k++)
        if (m->want[k].of == w->of && m->want[k].sensor == w->sensor)
            return imp__error(m->ctx, IMP_E_ARG, "sensor '%s': its %s is wanted twice",
                              s->name, want_words[w->of]);
    return IMP_OK;
}

/* An average or minimum above a maximum has no answer, whatever the lamps are. */
static enum imp_status contradiction_check(struct imp__design_model *m)
{
    for (size_t i = 0; i < m->n_wants; i++)
        for (size_t k = 0; k < m->n_wants; k++) {
            const struct imp_design_want *low = &m->want[i], *high = &m->want[k];
            if (high->of == IMP_WANT_MAXIMUM && low->sensor == high->sensor &&
                (low->of == IMP_WANT_AVERAGE || low->of == IMP_WANT_MINIMUM) &&
                low->value > high->value)
                return imp__error(
                    m->ctx, IMP_E_ARG,
                    "sensor '%s': %s %g and maximum %g contradict each other",
                    m->scene->sensors[low->sensor]->name, want_words[low->of], low->value,
                    high->value);
        }
    return IMP_OK;
}

static enum imp_status grid_take(struct imp__design_model *m, size_t want)
{
    const int sensor = m->want[want].sensor;
    size_t g = 0;
    while (g < m->n_grids && m->grid[g].sensor != sensor) g++;
    m->grid_of[want] = g;
    m->grid[g].rated |= m->want[want].of == IMP_WANT_UGR;
    if (g < m->n_grids) return IMP_OK;
    const struct imp_film_desc *f = &m->scene->sensors[sensor]->film;
    m->n_grids++;
    m->grid[g].sensor = sensor;
    m->grid[g].n = (size_t)f->crop_w * (size_t)f->crop_h;
    m->grid[g].first = m->n_points;
    m->n_points += m->grid[g].n;
    return IMP_OK;
}

enum imp_status imp__design_wants_take(struct imp__design_model *m,
                                       const struct imp_design_want *wants)
{
    if (m->n_wants == 0) return imp__error(m->ctx, IMP_E_ARG, "wants: nothing is wanted");
    m->want = imp__arena_array(m->arena, m->n_wants, sizeof *m->want);
    m->grid_of = imp__arena_array(m->arena, m->n_wants, sizeof *m->grid_of);
    m->grid = imp__arena_array(m->arena, m->n_wants, sizeof *m->grid);
    if (!m->want || !m->grid_of || !m->grid)
        return imp__error(m->ctx, IMP_E_NOMEM, "no memory for %zu wants", m->n_wants);
    for (size_t i = 0; i < m->n_wants; i++) {
        m->want[i] = (struct imp_design_want)IMP_DESIGN_WANT_INIT;
        IMP_CHECKED(imp__element_take(m->ctx, "imp_design_find", "wants", wants, i,
                                      &m->want[i], sizeof *m->want));
        IMP_CHECKED(want_check(m, i));
        IMP_CHECKED(grid_take(m, i));
    }
    return contradiction_check(m);
}

enum imp_status imp__design_options_take(struct imp__design_model *m,
                                         const struct imp_design_options *options)
{
    struct imp_design_options *o = &m->o;
    *o = (struct imp_design_options)IMP_DESIGN_OPTIONS_INIT;
    IMP_CHECKED(
        imp__options_take(m->ctx, "imp_design_find", "options", options, o, sizeof *o));
    IMP_FINITE(m->ctx, o->confidence, "options: confidence");
    IMP_FINITE(m->ctx, o->within, "options: within");
    if ((unsigned)o->least > IMP_LEAST_COST)
        return imp__error(m->ctx, IMP_E_ARG, "options: least = %d does not exist",
                          (int)o->least);
    if (o->confidence == 0) o->confidence = 0.95;
    if (o->rounds == 0) o->rounds = 4;
    if (o->within == 0) o->within = 0.05;
    if (o->nodes == 0) o->nodes = 20000;
    if (o->steps == 0) o->steps = 60;
    if (o->starts == 0) o->starts = 1;
    if (o->starts < 1 || o->starts > 1000)
        return imp__error(m->ctx, IMP_E_ARG, "options: starts = %d are not in 1 to 1000",
                          o->starts);
    IMP_FINITE(m->ctx, o->clearance, "options: clearance");
    if (o->clearance < 0 || o->steps < 1 || o->steps > 10000)
        return imp__error(
            m->ctx, IMP_E_ARG,
            "options: clearance %g is negative, or steps %d are not in 1 to "
            "10000",
            o->clearance, o->steps);
    if (!(o->confidence > 0 && o->confidence < 1))
        return imp__error(m->ctx, IMP_E_ARG, "options: confidence = %g is not in (0, 1)",
                          o->confidence);
    if (o->rounds < 1 || o->rounds > 20 || o->others < 0 || o->others > 100 ||
        !(o->within >= 0) || o->nodes < 1)
        return imp__error(m->ctx, IMP_E_ARG,
                          "options: rounds %d is not in 1 to 20, others %d not in 0 to "
                          "100, within %g negative or nodes %lld below 1",
                          o->rounds, o->others, o->within, (long long)o->nodes);
    return IMP_OK;
}
