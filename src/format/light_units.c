/* SPDX-License-Identifier: Apache-2.0
 *
 * Watts and lumens in one scene. Luminaires shine in lm and meters with `units` `photometric`
 * say lx, while the light of a Radiance file is in W m^-2 sr^-1 until the parameter `efficacy`
 * makes luminances of it: sums of both are in no unit. */
#include "light_units.h"
#include "color/convert.h"
#include "import.h"
#include <string.h>

/* The first node below `in`, itself included, that is so. */
typedef bool is_so(const struct imp_node *node);
static const struct imp_node *find(const struct imp_node *in, is_so *so)
{
    if (so(in)) return in;
    for (size_t i = 0; i < in->n_children; i++) {
        const struct imp_child *c = &in->children[i];
        const struct imp_node *found = c->node && !c->ref ? find(c->node, so) : NULL;
        if (found) return found;
    }
    return NULL;
}

static bool unit_is(const struct imp_node *node, const char *unit)
{
    const struct imp_prop *p = imp__node_prop(node, "units");
    return p && p->type == IMP_PROP_STRING && strcmp(p->string, unit) == 0;
}
static bool is_in_lumens(const struct imp_node *node)
{
    return !strcmp(node->tag, "emitter") && !strcmp(node->type, "ies") &&
           !unit_is(node, "radiometric");
}
static bool reads_lux(const struct imp_node *node)
{
    return !strcmp(node->tag, "sensor") && unit_is(node, "photometric");
}
static bool is_in_watts(const struct imp_node *node)
{
    return !strcmp(node->tag, "emitter") && node->loc.file &&
           imp__import_of(node->loc.file) == imp__rad_read;
}
/* Cameras have no units to be wrong: nobody reads their pictures as W m^-2 sr^-1. */
static bool reads_watts(const struct imp_node *node)
{
    return !strcmp(node->tag, "sensor") && !imp__node_prop(node, "units") &&
           (!strcmp(node->type, "irradiancemeter") ||
            !strcmp(node->type, "radiancemeter"));
}

static const char *name_of(const struct imp_node *node)
{
    return node->id ? node->id : node->type;
}

void imp__light_units_mixed(const struct imp_scene *scene, const struct imp_node *root)
{
    const struct imp_node *watts = find(root, is_in_watts);
    const struct imp_node *lumens = find(root, is_in_lumens);
    if (!lumens) lumens = find(root, reads_lux);
    if (!watts || !lumens) return;
    const bool lamp = !strcmp(lumens->tag, "emitter");
    imp__warn(scene->ctx,
              "%s: light '%s' is in W m^-2 sr^-1, and %s '%s' %s: give the file the "
              "parameter efficacy (179, Radiance's lm/W; 1 if it is in cd m^-2)",
              watts->loc.file, name_of(watts), lamp ? "luminaire" : "sensor",
              name_of(lumens), lamp ? "in lm" : "is photometric");
}

void imp__light_units_unsaid(const struct imp_scene *scene)
{
    const struct imp_node *lumens = find(scene->root, is_in_lumens);
    const struct imp_node *meter = find(scene->root, reads_watts);
    char where[256];
    if (!lumens || !meter || imp__is_spectral(scene->mode)) return;
    imp__warn(scene->ctx,
              "%s: sensor '%s' has no units, which makes them W, and luminaire '%s' "
              "is in lm: give it the units photometric",
              imp__loc_text(meter->loc, where, sizeof where), name_of(meter),
              name_of(lumens));
}
