/* SPDX-License-Identifier: Apache-2.0
 *
 * What moves, over the pictures: axes at the middle of each thing, the way of a search, where a
 * derivative points, and, on a page that is served, a handle. */
"use strict";

/* ---- Data ----------------------------------------------------------------------------- */

const of_length = (x, n) => Array.isArray(x) && x.length === n && x.every(is_number);

/* Things with places in the pictures: where an answer of a fit found them, or as a page that is
 * served has them now, and where an answer of gradient has its derivatives. */
function things_of(items) {
    const answers = (kind) => items.filter((i) => i.kind === kind && i.data && Array.isArray(i.data.places)).map((i) => i.data);
    const now = answers("places").length ? answers("places") : answers("fit"), by = answers("gradient");
    return [...now, ...by].flatMap((data) => data.places
        .filter((p) => p && of_length(p.at, 2) && Array.isArray(p.axes) && of_length(p.axes.flat(), 6) && of_length(p.shifts, 3) && is_number(p.radius))
        .map((p) => ({...p, by: by.includes(data) && Array.isArray(data.params) ? derivative_of(data, p) : null})));
}

/* Where the thing has to go for a lower loss, or for more of what the derivative is of. */
function derivative_of(data, place) {
    const p = data.params.find((param) => param.name === place.name);
    if (!p || !Array.isArray(p.grad) || !Array.isArray(p.se)) return null;
    const sign = data.functional === "loss" ? -1 : 1, at = (list, k) => (is_number(list[k]) ? list[k] : 0);
    const part = (numbers) => {
        const v = numbers.map((k) => sign * at(p.grad, k)), se = Math.hypot(...numbers.map((k) => at(p.se, k)));
        return {v, size: Math.hypot(...v), sure: Math.hypot(...v) > 2 * se};
    };
    return {shift: part(place.shifts), turn: place.turns ? part([3, 4, 5]) : null, loss: sign < 0};
}

/* ---- Drawing ---------------------------------------------------------------------------- */

const axis_colours = ["#e4473a", "#3aa845", "#3f78e0"], derivative_colour = "#ffd23a";

/* points [n][2], on the canvas, over a dark rim. */
function line_draw(context, points, colour, width, dashed = false) {
    for (const [style, w] of [["rgba(0,0,0,.6)", width + 2], [colour, width]]) {
        context.beginPath();
        points.forEach(([x, y], i) => (i ? context.lineTo(x, y) : context.moveTo(x, y)));
        context.setLineDash(dashed ? [3 * width, 2 * width] : []);
        context.strokeStyle = style;
        context.lineWidth = w;
        context.stroke();
    }
    context.setLineDash([]);
}
function head_draw(context, from, to, size, colour) {
    const a = Math.atan2(to[1] - from[1], to[0] - from[0]), corner = (turn) => [to[0] - size * Math.cos(a + turn), to[1] - size * Math.sin(a + turn)];
    line_draw(context, [corner(0.5), to, corner(-0.5)], colour, size / 5);
}
function arrow_draw(context, points, size, colour, dashed) {
    if (points.length < 2) return;
    line_draw(context, points, colour, size / 5, dashed);
    head_draw(context, points[points.length - 2], points[points.length - 1], size, colour);
}

/* A vector of the world in pixels of the picture. */
const in_pixels = (place, v) => [0, 1].map((i) => place.axes.reduce((sum, axis, k) => sum + v[k] * axis[i], 0));

/* An arc about a rotation vector, as long as its share of the largest; world, from the middle. */
function arc_of(turn, radius, largest) {
    const n = turn.v.map((x) => x / turn.size), k = n.map(Math.abs).indexOf(Math.min(...n.map(Math.abs)));
    const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
    const across = cross(n, [0, 1, 2].map((i) => Number(i === k))), size = Math.hypot(...across), u = across.map((x) => x / size), w = cross(n, u);
    const sweep = 1.5 * Math.PI * Math.max(turn.size / largest, 0.1), steps = 32;
    return Array.from({length: steps + 1}, (_, i) => [0, 1, 2].map((c) => radius * (u[c] * Math.cos(sweep * i / steps) + w[c] * Math.sin(sweep * i / steps))));
}

/* at: the window of the picture that the canvas shows (page_pictures.js). */
function things_draw(context, layer, at, things) {
    const here = things.filter((t) => t.view === layer.view), unit = Math.max(context.canvas.width / 90, 5);
    const to_canvas = ([x, y]) => [(x - at.x) / at.step, (y - at.y) / at.step];
    const shifts = here.filter((t) => t.by).map((t) => Math.hypot(...in_pixels(t, t.by.shift.v)));
    const longest = Math.max(...shifts, 0), turned = Math.max(...here.filter((t) => t.by && t.by.turn).map((t) => t.by.turn.size), 0);
    for (const t of here) {
        const middle = to_canvas(t.at), from = (v) => to_canvas(in_pixels(t, v).map((x, i) => t.at[i] + x));
        if (Array.isArray(t.way) && t.way.length) {
            const way = [...t.way.filter((p) => of_length(p, 2)), t.at].map(to_canvas);
            line_draw(context, way, "#fff", unit / 6);
            context.strokeStyle = "#fff";
            context.strokeRect(way[0][0] - unit / 3, way[0][1] - unit / 3, unit / 1.5, unit / 1.5);
        }
        axis_colours.forEach((colour, k) => line_draw(context, [middle, from([0, 1, 2].map((i) => (i === k ? t.radius : 0)))], colour, unit / 5));
        if (t.by && longest > 0 && t.by.shift.size > 0) {
            const far = 0.15 * layer.width / longest;
            arrow_draw(context, [middle, from(t.by.shift.v.map((x) => x * far))], unit, derivative_colour, !t.by.shift.sure);
        }
        if (t.by && t.by.turn && turned > 0 && t.by.turn.size > 0)
            arrow_draw(context, arc_of(t.by.turn, t.radius, turned).map(from), unit, derivative_colour, !t.by.turn.sure);
        context.beginPath();
        context.arc(...middle, unit / 2.5, 0, 2 * Math.PI);
        context.fillStyle = "#fff";
        context.fill();
        context.lineWidth = 1;
        context.strokeStyle = "#000";
        context.stroke();
        context.font = `${Math.round(1.6 * unit)}px sans-serif`;
        context.lineWidth = 3;
        context.strokeStyle = "rgba(0,0,0,.7)";
        const text = t.by ? `derivative by ${t.name}` : t.name;
        context.strokeText(text, middle[0] + unit, middle[1] - unit);
        context.fillText(text, middle[0] + unit, middle[1] - unit);
    }
}

/* What the drawing means. */
function things_legend(things, held) {
    if (!things.length) return "";
    const by = things.find((t) => t.by);
    return ["Things that move: red, green and blue are x, y and z, as long as half the diagonal of the thing's box.",
        held ? "A drag at the white point moves it." : "",
        things.some((t) => Array.isArray(t.way) && t.way.length) ? "White: the way of the search, from the square." : "",
        by ? `Yellow: where a step ${by.by.loss ? "lowers the loss" : "raises the value"} most, the arrow by shifts, the arc by turns; dashed within two standard errors of zero.` : ""].filter(Boolean).join(" ");
}

/* ---- Handles ------------------------------------------------------------------------------ */

/* The thing whose middle is next to a place on the canvas. */
function thing_at(things, layer, at, x, y, near) {
    const far = (t) => Math.hypot((t.at[0] - at.x) / at.step - x, (t.at[1] - at.y) / at.step - y);
    return things.filter((t) => t.view === layer.view && far(t) < near).sort((a, b) => far(a) - far(b))[0] || null;
}

/* The shortest shift, world, that moves what is seen by d pixels: A^T (A A^T)^-1 d. */
function shift_of(place, d) {
    const row = (i) => place.axes.map((axis) => axis[i]), dot = (a, b) => a.reduce((sum, x, k) => sum + x * b[k], 0);
    const [r, s] = [row(0), row(1)], rr = dot(r, r), rs = dot(r, s), ss = dot(s, s), det = rr * ss - rs * rs;
    if (!(det > 0)) return [0, 0, 0];
    const p = (ss * d[0] - rs * d[1]) / det, q = (rr * d[1] - rs * d[0]) / det;
    return r.map((x, k) => p * x + q * s[k]);
}
