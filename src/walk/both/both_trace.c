/* SPDX-License-Identifier: Apache-2.0
 *
 * One sample from both ends is decided (both.h): first the walk from the light, then the
 * walk from the sensor, whose vertices are joined with those of the first. They share
 * their time, their wavelengths and the lane that draws. */
#include "both.h"
#include "kind/bsdf/transport.h"
#include "walk/core/one_step.h"
#include "walk/path/first_segment.h"
#include "walk/path/surface_sensor.h"

/* ---- Joints ------------------------------------------------------------------------ */

static struct imp_joint *joint_add(struct imp_step *s, struct imp_vertex *y,
                                   const struct imp_both_place *z)
{
    struct imp_both *b = s->both;
    struct imp_joint *j = imp__arena_take(s->arena, 1, sizeof *j);
    if (!j) {
        s->walk->dropped = IMP_DROP_MEMORY;
        return NULL;
    }
    *j = (struct imp_joint){.y = y, .z = z->vertex, .z_number = z->number};
    *b->joints_end = j;
    b->joints_end = &j->next;
    return j;
}

/* The joint's share of the densities of all lanes, over the product of both walks'. */
static double lanes_join(const struct imp_step *s, const struct imp_lane_mis *z)
{
    const struct imp_lane_mis *y = &s->lanes;
    const int n = imp__lane_mis_count(s);
    double sum = 0;
    for (int c = 0; c < n; c++) sum += y->ratio[c] * z->ratio[c];
    return n / (sum * y->weight * z->weight);
}

/* Is the way free? Sets its transmittance, and the track that is kept of it. */
static bool sees(struct imp_step *s, struct imp_vertex *v, int k,
                 const struct imp_surface *at, const struct imp_shadow *shadow,
                 imp_spec *T, struct imp_track **track)
{
    *T = imp__spec(1);
    *track = NULL;
    if (!s->segment->sees)
        return !imp__occluded_at(s->scene, s->walk->time, &shadow->o, &shadow->d, 0,
                                 shadow->reach);
    /* Each way has random numbers of its own. */
    struct imp_walk *walk = s->walk;
    const struct imp_key key = walk->key;
    struct imp_track *light = s->recorded ? v->to_light : NULL;
    if (s->recorded) v->to_light = NULL;
    walk->key = imp__key_branch(key, s->depth, 0x8000 + k);
    const bool free = s->segment->sees(s, v, at, shadow, T);
    walk->key = key;
    if (!s->recorded) return free;
    *track = v->to_light;
    v->to_light = light;
    return free;
}

/* The vertex at work, joined with place k of the walk from the light. */
static void join(struct imp_step *s, struct imp_vertex *v, int k,
                 const struct imp_surface *at, const struct imp_frame *frame)
{
    const struct imp_both *b = s->both;
    const struct imp_both_place *z = &b->place[k];
    const struct imp_end *end = &b->light[k];
    const struct imp_bsdf *by = v->bsdf, *bz = z->vertex->bsdf;
    const imp_v3 d = end->p - at->p;
    const double r2 = imp__dot(d, d);
    if (!(r2 > 0)) return;
    const imp_v3 w = d * (1 / sqrt(r2));
    const struct imp_dirs at_y = {s->wo, imp__decide(imp__to_local(frame, w)), IMP_SMOOTH,
                                  imp__derivative_wanted(s, by)};
    const struct imp_dirs at_z = {imp__decide(imp__to_local(&z->frame, -w)), z->wi,
                                  IMP_SMOOTH, imp__derivative_wanted(s, bz)};

    /* The scattering at both ends. */
    imp_spec f_y, f_z;
    imp__bsdf_eval(by, s->at.carried, s->in, &at_y, &f_y);
    if (imp__is_zero_used(f_y, s->at.carried) && !at_y.derivative) return;
    imp__bsdf_eval(bz, s->at.carried, z->in, &at_z, &f_z);
    if (imp__is_zero_used(f_z, s->at.carried) && !at_z.derivative) return;
    if (!s->recorded && imp__is_zero_used(f_y * f_z * z->P, s->at.carried)) return;
    const double c = z->vertex->shape
                         ? imp__bsdf_exchange(bz, z->in, &at_z, -imp__dot(w, end->ng),
                                              imp__dot(z->d, end->ng))
                         : 1;
    double weight = imp__both_joint_weight(s, k, by, &at_y, &at_z) * c / r2;
    if (imp_unlikely(s->lanes.weight != 1 || z->lanes.weight != 1))
        weight *= lanes_join(s, &z->lanes);
    weight = imp__decide1(weight);
    if (!(weight > 0)) return;

    /* Do they see each other? */
    struct imp_shadow shadow;
    imp_spec T;
    struct imp_track *track;
    const struct imp_sensor_sample to = {.wo = w, .p = end->p, .ng = end->ng};
    imp__light_shadow_aim(at, &to, &shadow);
    if (!sees(s, v, k, at, &shadow, &T, &track)) return;
    v->b += f_y * f_z * z->P * T * weight;
    if (!s->recorded) return;
    struct imp_joint *j = joint_add(s, v, z);
    if (!j) return;
    imp__store_v3(j->wi, at_y.wi);
    imp__store_v3(j->wo, at_z.wo);
    j->weight = (imp_decided)weight;
    j->track = track;
    j->f_y = f_y;
    j->f_z = f_z;
    j->T = T;
}

/* ---- The walk from the sensor ------------------------------------------------------ */

static void nothing(struct imp_step *s)
{
    if (imp__both_eye_arrives(s, NULL)) imp__sky_meet(s);
}

static bool arrive(struct imp_step *s, struct imp_vertex *v, const struct imp_hit *hit,
                   const struct imp_surface *at, const struct imp_frame *frame)
{
    (void)v, (void)hit, (void)frame;
    return imp__both_eye_arrives(s, at);
}

/* Two segments more are within max_depth. */
static bool bounces(const struct imp_step *s)
{
    return imp__light_depth_allows(s, s->depth + 2);
}

/* What a sensor that is a surface emits itself is not met where its walk begins. */
static bool meet(struct imp_step *s, struct imp_vertex *v, const struct imp_hit *hit,
                 const struct imp_surface *at)
{
    if (hit && v->shape && v->shape->emitter >= 0 &&
        imp__light_depth_allows(s, s->depth + 1))
        imp__emission_meet(s, v, v->shape->emitter, 1, hit, at);
    return true;
}

static bool link_draw(struct imp_step *s, const struct imp_vertex *v,
                      const struct imp_surface *at, struct imp_link *link)
{
    return imp__light_point(s, v->bsdf, at, &link->light);
}

static void link_weigh(struct imp_step *s, struct imp_vertex *v,
                       const struct imp_surface *at, const struct imp_frame *frame,
                       struct imp_link *link)
{
    imp__light_sample(s, v, at, frame, &link->light, &link->shadow);
}

/* Joints add to B, too. */
static void link_see(struct imp_step *s, struct imp_vertex *v,
                     const struct imp_surface *at, const struct imp_link *link)
{
    const struct imp_shadow *shadow = &link->shadow;
    imp_spec T = imp__spec(1);
    const bool seen = s->segment->sees
                          ? s->segment->sees(s, v, at, shadow, &T)
                          : !imp__occluded_at(s->scene, s->walk->time, &shadow->o,
                                              &shadow->d, 0, shadow->reach);
    if (!seen) return;
    v->b += shadow->brings * T;
    if (!s->recorded) return;
    v->d.connection = IMP_CONNECTED;
    v->light_w *= T;
}

/* A sensor that is a surface, of depth -1, is connected by the walk from the light. */
static bool join_all(struct imp_step *s, struct imp_vertex *v,
                     const struct imp_surface *at, const struct imp_frame *frame)
{
    if ((v->bsdf->flags & IMP_BSDF_SMOOTH) && s->depth >= 0)
        for (int k = 1; k < s->both->n_light && !s->walk->dropped; k++)
            if (s->both->place[k].vertex && imp__light_depth_allows(s, s->depth + 2 + k))
                join(s, v, k, at, frame);
    return !s->walk->dropped;
}

static bool scatter(struct imp_step *s, struct imp_vertex *v,
                    const struct imp_surface *at, const struct imp_frame *frame,
                    struct imp_direction *direction)
{
    if (!imp__scatter_along(s, v, at, frame, direction)) return false;
    imp__both_eye_leaves(s, v->bsdf, frame);
    return true;
}

static const struct imp_end_ops eye_end = {.nothing = nothing,
                                           .arrive = arrive,
                                           .bounces = bounces,
                                           .meet = meet,
                                           .link_draw = link_draw,
                                           .link_weigh = link_weigh,
                                           .link_see = link_see,
                                           .join = join_all,
                                           .direction_draw = imp__direction_begin,
                                           .scatter = scatter};

/* A sensor that is a surface is the first vertex. */
static bool meter_begin(struct imp_step *s)
{
    struct imp_surface at;
    struct imp_frame frame;
    struct imp_vertex *v = imp__meter_begin(s, &at, &frame);
    if (!v) return false;
    struct imp_end *end = &s->both->from_eye[0];
    end->p = at.p;
    end->ng = at.ng;
    if (!imp__vertex_work(&eye_end, s, v, NULL, &at, &frame)) return false;
    s->depth++;
    return true;
}

/* ---- Both -------------------------------------------------------------------------- */

static void eye_follow(const struct imp_tracer *tracer, struct imp_both *b)
{
    struct imp_walk *walk = &b->eye;
    imp_spec scratch[IMP_INPUTS_MAX];
    struct imp_step s = {.tracer = tracer,
                         .scene = tracer->scene,
                         .walk = walk,
                         .arena = b->arena,
                         .both = b,
                         .recorded = !tracer->value_only,
                         .scratch = scratch,
                         .at.carried = walk->waves ? &walk->waves->carried : NULL,
                         .segment = imp__segment_first(tracer),
                         .o = walk->ray.o,
                         .from = walk->ray.o,
                         .d = walk->ray.d,
                         .t_min = walk->ray.t_near,
                         .t_max = walk->ray.t_far,
                         .beta = imp__spec(1),
                         .eta = 1,
                         .lanes = IMP_LANE_MIS_INIT};
    walk->valid = true;
    s.lanes.drew = imp__lane_drawn(walk->key, imp__lane_mis_count(&s));
    const bool begun = tracer->sensor->shape ? meter_begin(&s)
                       : s.segment->begin    ? s.segment->begin(&s)
                                             : true;
    if (begun)
        while (imp__one_step(&eye_end, &s)) s.depth++;
}

/* What the walk from the sensor brings is a reach like those of the other. */
static void eye_reach(struct imp_light_walk *out)
{
    struct imp_both *b = out->both;
    struct imp_reach *r = imp__arena_take(b->arena, 1, sizeof *r);
    if (!r) {
        out->walk.dropped = IMP_DROP_MEMORY;
        return;
    }
    *r = (struct imp_reach){.px = b->eye.px, .py = b->eye.py};
    struct imp_reach **last = &out->reach;
    while (*last) last = &(*last)->next;
    *last = r;
    out->n_reach++;
}

void imp__both_trace(const struct imp_tracer *tracer, struct imp_arena *arena,
                     int64_t index, struct imp_light_walk *out)
{
    const struct imp_sensor *sensor = tracer->sensor;
    const struct imp_film_desc *film = &sensor->film;
    const int64_t pixels = (int64_t)film->crop_w * film->crop_h;
    const int pixel = (int)(index % pixels);
    struct imp_walk *walk = &out->walk;
    struct imp_both *b = imp__arena_take(arena, 1, sizeof *b);
    if (!b) {
        walk->dropped = IMP_DROP_MEMORY;
        return;
    }
    *b = (struct imp_both){.arena = arena,
                           .sensor = sensor,
                           .pixels = (double)pixels,
                           .joints_end = &b->joints,
                           .sees = true};
    out->both = b;
    imp__walk_begin(tracer, pixel % film->crop_w, pixel / film->crop_w, index / pixels,
                    &b->eye, b->lens);
    if (tracer->wavelengths &&
        !imp__walk_wave(tracer, arena, imp__wave_draw(tracer, &b->eye, index), &b->eye)) {
        walk->dropped = b->eye.dropped;
        return;
    }
    struct imp_end *end = imp__both_eye_end(b);
    if (end) {
        if (sensor->shape) end->own = 1 / sensor->shape->area;
        else end->p = b->eye.ray.o;
        walk->time = b->eye.time;
        walk->waves = b->eye.waves;
        walk->wave = b->eye.wave;
        imp__light_walk_follow(tracer, arena, out);
        if (!walk->dropped) eye_follow(tracer, b);
        if (b->eye.dropped) walk->dropped = b->eye.dropped;
    } else {
        walk->dropped = IMP_DROP_MEMORY;
    }
    if (!walk->dropped) eye_reach(out);
    imp__light_walk_close(tracer, out);
}
