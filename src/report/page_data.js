/* SPDX-License-Identifier: Apache-2.0
 *
 * The page's data: half floats out of base64, layers of pictures, and text. Names and
 * sentences of scenes and files become text nodes, never markup. */
"use strict";

/* ---- Elements ----------------------------------------------------------------------- */

/* make("td", {class: "text"}, "some text", another_element) */
function make(tag, attributes, ...children) {
    const e = document.createElement(tag);
    for (const [key, value] of Object.entries(attributes || {}))
        if (typeof value === "function") e.addEventListener(key, value);
        else if (value !== null && value !== undefined) e.setAttribute(key, value);
    for (const child of children)
        if (child !== null && child !== undefined) e.append(child);
    return e;
}
function make_svg(tag, attributes, text) {
    const e = document.createElementNS("http://www.w3.org/2000/svg", tag);
    for (const [key, value] of Object.entries(attributes || {})) e.setAttribute(key, value);
    if (text !== undefined) e.textContent = text;
    return e;
}

/* ---- Numbers ------------------------------------------------------------------------ */

const is_number = (x) => typeof x === "number" && Number.isFinite(x);

/* Six digits, as the command prints them. */
function show(x, digits = 6) {
    if (!is_number(x)) return "–";
    if (x === 0) return "0";
    const size = Math.abs(x);
    return size >= 1e-4 && size < 10 ** digits ? String(Number(x.toPrecision(digits))) : x.toExponential(digits - 1).replace(/\.?0+e/, "e");
}
/* A value with as many digits as its error leaves, then the error with two. */
function show_error(x, se) {
    if (!is_number(x) || !is_number(se) || se <= 0) return show(x);
    const digits = Math.ceil(Math.log10(Math.abs(x) / se)) + 2;
    return `${show(x, Math.min(Math.max(digits, 1), 9))} ± ${show(se, 2)}`;
}

/* ---- Pictures ----------------------------------------------------------------------- */

const half_table = (() => {
    const t = new Float32Array(1 << 16);
    for (let i = 0; i < t.length; i++) {
        const sign = i & 0x8000 ? -1 : 1, exponent = (i >> 10) & 31, fraction = i & 1023;
        t[i] = sign * (exponent === 31 ? (fraction ? NaN : Infinity)
            : exponent ? 2 ** (exponent - 15) * (1 + fraction / 1024) : 2 ** -24 * fraction);
    }
    return t;
})();

/* Numbers [channel][y][x] times `scale`, of n halves: a zlib stream of their low bytes and
 * then of their high bytes. */
async function decode_planes(text, scale, n) {
    const packed = atob(text), bytes = new Uint8Array(packed.length), out = new Float32Array(n);
    for (let i = 0; i < bytes.length; i++) bytes[i] = packed.charCodeAt(i);
    const halves = new Uint8Array(await new Response(new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"))).arrayBuffer());
    if (halves.length !== 2 * n) throw new Error(`${halves.length} bytes for ${n} numbers`);
    for (let i = 0; i < n; i++) out[i] = scale * half_table[halves[i] | (halves[n + i] << 8)];
    return out;
}
/* Pictures among the items get their numbers, or an `error`. */
async function unpack(items) {
    await Promise.all(items.map(async (item) => {
        if (!item || typeof item.pixels !== "string") return;
        try {
            const n = item.width * item.height * item.channels.length;
            item.mean = await decode_planes(item.pixels, item.scale, n);
            item.errors = item.se ? await decode_planes(item.se, item.se_scale, n) : null;
        } catch (error) {
            item.error = error;
        }
        item.pixels = item.se = null; /* the text is large */
    }));
}

/* A layer is what the viewer shows: one or three planes, their errors, and how to read
 * them. `signed`: blue below 0, red above. `luminance`: light, seen as it is; other single
 * numbers (a depth) are seen in false colour. */
class Layer {
    constructor(name, width, height, planes, errors, options = {}) {
        Object.assign(this, {name, width, height, planes, errors, signed: false, luminance: true, unit: "", view: 0}, options);
        this.count = planes.length;
    }
    at(c, x, y) { return this.planes[c][y * this.width + x]; }
    error_at(c, x, y) { return this.errors ? this.errors[c][y * this.width + x] : NaN; }
    /* 99.5 % of |values| are below. */
    range() {
        if (this.range_ === undefined) {
            const all = [], n = this.planes[0].length, step = Math.max(1, Math.floor(n / 20000));
            for (const p of this.planes)
                for (let i = 0; i < n; i += step) if (Number.isFinite(p[i])) all.push(Math.abs(p[i]));
            all.sort((a, b) => a - b);
            this.range_ = (all.length && all[Math.min(all.length - 1, Math.floor(0.995 * all.length))]) || 1;
        }
        return this.range_;
    }
}

/* Channels of one picture by the part of their names before the last dot: "albedo.R",
 * "albedo.G", "albedo.B" are the layer "albedo". */
function layers_of(item) {
    const n = item.width * item.height, groups = new Map(), layers = [];
    if (!item.mean) throw item.error || new Error("it has no pixels");
    const mean = item.mean, se = item.errors;
    item.channels.forEach((channel, c) => {
        const dot = channel.lastIndexOf("."), key = dot < 0 ? "" : channel.slice(0, dot);
        if (!groups.has(key)) groups.set(key, []);
        groups.get(key).push(c);
    });
    const plane = (all, c) => all.subarray(c * n, (c + 1) * n);
    const last = (c) => item.channels[c].slice(item.channels[c].lastIndexOf(".") + 1);
    /* Channels "se.R" of a picture without errors of its own are those of "R". */
    const error_of = new Map();
    if (!se)
        item.channels.forEach((channel, c) => {
            const of = channel.startsWith("se.") ? item.channels.indexOf(channel.slice(3)) : -1;
            if (of >= 0) error_of.set(of, c);
        });
    for (const [key, members] of groups) {
        if (key === "se" && members.every((c) => [...error_of.values()].includes(c))) continue;
        const three = ["RGB", "XYZ"].map((names) => [...names].map((name) => members.find((c) => last(c) === name)))
            .find((set) => set.every((c) => c !== undefined)) || [];
        const sets = [...(three.length ? [three] : []), ...members.filter((c) => !three.includes(c)).map((c) => [c])];
        for (const set of sets) {
            const own = set.length === 3 ? key : item.channels.length === 1 ? "" : item.channels[set[0]];
            layers.push(new Layer([item.name, own].filter(Boolean).join(" · "), item.width, item.height,
                set.map((c) => plane(mean, c)), se ? set.map((c) => plane(se, c)) : set.every((c) => error_of.has(c)) ? set.map((c) => plane(mean, error_of.get(c))) : null,
                {signed: item.kind === "derivative", unit: item.unit || "", view: item.view || 0, role: key ? "" : item.role || "", not_finite: layers.length ? 0 : item.not_finite || 0, of_channels: item.channels.length,
                 luminance: set.length === 3 || last(set[0]) === "Y"}));
        }
    }
    return layers;
}

/* picture - target, in standard errors where there are any. */
function residual_of(picture, target) {
    if (picture.width !== target.width || picture.height !== target.height || picture.count !== target.count) return null;
    const errors = picture.errors || target.errors;
    const planes = picture.planes.map((p, c) => p.map((v, i) => {
        const d = v - target.planes[c][i];
        if (!errors) return d;
        const s = Math.hypot(picture.errors ? picture.errors[c][i] : 0, target.errors ? target.errors[c][i] : 0);
        return s > 0 ? d / s : d === 0 ? 0 : NaN;
    }));
    return new Layer(errors ? "residual / standard error" : "residual", picture.width, picture.height, planes, null,
        {signed: true, unit: errors ? "standard errors" : picture.unit, view: picture.view, role: "residual",
         range_: errors ? 4 : undefined});
}
