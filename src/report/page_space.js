/* SPDX-License-Identifier: Apache-2.0
 *
 * Lines in space on a canvas, turned by dragging and by arrow keys; and plots with axes. */
"use strict";

const style_of = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();

/* A canvas for what is between the corners lo and hi, seen at first from the direction
 * `away`. draw(context, line, project, towards) draws it: line(a, b) between places,
 * project(p) -> [x, y, nearness], towards() -> the direction to the eye. click(x, y) and
 * key(event) (true: it is taken) may be missing. */
function space_view(lo, hi, away, label, {draw: paint, click, key}) {
    const centre = lo.map((v, c) => (v + hi[c]) / 2), radius = Math.hypot(...lo.map((v, c) => hi[c] - v)) / 2 || 1;
    const state = {turn: Math.atan2(away[0], away[2]) + 0.5, tilt: Math.atan2(away[1], Math.hypot(away[0], away[2])) + 0.25, zoom: 1}, first = {...state};
    const canvas = make("canvas", {width: 1200, height: 800, tabindex: 0, role: "img", class: "space", "aria-label": label}), context = canvas.getContext("2d");
    function project(p) {
        const x = p[0] - centre[0], y = p[1] - centre[1], z = p[2] - centre[2];
        const ct = Math.cos(state.turn), st = Math.sin(state.turn), cp = Math.cos(state.tilt), sp = Math.sin(state.tilt);
        const u = ct * x - st * z, depth = st * x + ct * z, scale = state.zoom * 0.5 * canvas.height / radius;
        return [canvas.width / 2 + scale * u, canvas.height / 2 - scale * (cp * y - sp * depth), sp * y + cp * depth];
    }
    function line(from, to) {
        const a = project(from), b = project(to);
        context.beginPath();
        context.moveTo(a[0], a[1]);
        context.lineTo(b[0], b[1]);
        context.stroke();
    }
    const towards = () => [Math.sin(state.turn) * Math.cos(state.tilt), Math.sin(state.tilt), Math.cos(state.turn) * Math.cos(state.tilt)];
    function zoom(factor) { state.zoom = Math.min(Math.max(state.zoom * factor, 0.1), 50); }
    function redraw() {
        const corner = (i) => [i & 1 ? hi[0] : lo[0], i & 2 ? hi[1] : lo[1], i & 4 ? hi[2] : lo[2]];
        /* Colours stand for values, from dark to bright: the ground is dark in all themes. */
        context.fillStyle = "#15171a";
        context.fillRect(0, 0, canvas.width, canvas.height);
        context.lineWidth = 1.3;
        context.strokeStyle = "#8a929c";
        for (let i = 0; i < 8; i++) for (const bit of [1, 2, 4]) if (!(i & bit)) line(corner(i), corner(i | bit));
        paint(context, line, project, towards);
    }
    let drag = null;
    canvas.addEventListener("pointerdown", (e) => { drag = {x: e.clientX, y: e.clientY, moved: false}; canvas.setPointerCapture(e.pointerId); });
    canvas.addEventListener("pointermove", (e) => {
        if (!drag || !drag.moved && Math.abs(e.clientX - drag.x) + Math.abs(e.clientY - drag.y) < 3) return;
        state.turn -= (e.clientX - drag.x) * 0.01;
        state.tilt = Math.min(Math.max(state.tilt + (e.clientY - drag.y) * 0.01, -1.57), 1.57);
        drag = {x: e.clientX, y: e.clientY, moved: true};
        redraw();
    });
    canvas.addEventListener("pointerup", (e) => {
        const still = drag && !drag.moved, b = canvas.getBoundingClientRect();
        drag = null;
        if (still && click) click((e.clientX - b.left) * canvas.width / b.width, (e.clientY - b.top) * canvas.height / b.height);
    });
    canvas.addEventListener("wheel", (e) => {
        if (!e.ctrlKey && document.activeElement !== canvas) return; /* the page scrolls */
        e.preventDefault();
        zoom(e.deltaY < 0 ? 1.1 : 1 / 1.1);
        redraw();
    }, {passive: false});
    canvas.addEventListener("keydown", (e) => {
        const step = {ArrowLeft: [-0.1, 0], ArrowRight: [0.1, 0], ArrowUp: [0, 0.1], ArrowDown: [0, -0.1]}[e.key];
        if (step) {
            state.turn += step[0];
            state.tilt = Math.min(Math.max(state.tilt + step[1], -1.57), 1.57);
        } else if (e.key === "+" || e.key === "=") zoom(1.25);
        else if (e.key === "-") zoom(0.8);
        else if (e.key === "0") Object.assign(state, first);
        else if (!key || !key(e)) return;
        e.preventDefault();
        redraw();
    });
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", redraw);
    return {canvas, redraw, project, radius, centre};
}

/* ---- Plots ----------------------------------------------------------------------------- */

/* 1, 2 or 5 times a power of ten, about n of them from lo to hi. */
function ticks(lo, hi, n = 5) {
    const raw = (hi - lo) / n, power = 10 ** Math.floor(Math.log10(raw)), step = [1, 2, 5, 10].map((m) => m * power).find((s) => s >= raw * 0.75) || power;
    const found = [];
    for (let k = Math.ceil(lo / step - 1e-9); k * step <= hi + 1e-9 * step && found.length < 50; k++) found.push(Number((k * step).toPrecision(12)));
    return found;
}

/* An SVG with axes from x[0] to x[1] and y[0] to y[1], their labels, and at(x, y) -> place. */
function plot_axes({width = 420, height = 300, x, y, x_label = "", y_label = "", label, left = 66}) {
    const bottom = 42, top = 10, right = 14;
    const [x_lo, x_hi] = x[1] > x[0] ? x : [x[0] - 0.5, x[0] + 0.5], [y_lo, y_hi] = y[1] > y[0] ? y : [y[0] - 0.5, y[0] + 0.5];
    const at_x = (v) => left + (width - left - right) * (v - x_lo) / (x_hi - x_lo), at_y = (v) => height - bottom - (height - bottom - top) * (v - y_lo) / (y_hi - y_lo);
    const svg = make_svg("svg", {viewBox: `0 0 ${width} ${height}`, width, height, role: "img", "aria-label": label});
    for (const v of ticks(x_lo, x_hi, 4))
        svg.append(make_svg("line", {x1: at_x(v), x2: at_x(v), y1: top, y2: height - bottom, class: "axis"}), make_svg("text", {x: at_x(v), y: height - bottom + 17, "text-anchor": "middle"}, show(v, 3)));
    for (const v of ticks(y_lo, y_hi, 5))
        svg.append(make_svg("line", {x1: left, x2: width - right, y1: at_y(v), y2: at_y(v), class: "axis"}), make_svg("text", {x: left - 7, y: at_y(v) + 4, "text-anchor": "end"}, show(v, 4)));
    svg.append(make_svg("text", {x: (left + width - right) / 2, y: height - 6, "text-anchor": "middle"}, x_label),
        make_svg("text", {transform: `translate(13 ${(top + height - bottom) / 2}) rotate(-90)`, "text-anchor": "middle"}, y_label));
    return {svg, at: (u, v) => [at_x(u), at_y(v)]};
}

/* Samples [height][width], row 0 on top, over x[0] to x[1] and y[0] to y[1]: an image by
 * colour(value) -> [r, g, b], and isolines with their numbers. */
function field_plot({values, width, height, wide = 480, x, y, x_label, y_label, label, colour, levels, digits = 5}) {
    const canvas = make("canvas", {width, height}), image = canvas.getContext("2d").createImageData(width, height);
    values.forEach((v, i) => image.data.set([...(is_number(v) ? colour(v) : [128, 128, 128]), 255], 4 * i));
    canvas.getContext("2d").putImageData(image, 0, 0);
    const aspect = (y[1] - y[0]) / (x[1] - x[0]) || 1, tall = Math.min(Math.max((wide - 80) * aspect + 52, 180), 640);
    const {svg, at} = plot_axes({width: wide, height: tall, x, y, x_label, y_label, label});
    const [x0, y1] = at(x[0], y[0]), [x1, y0] = at(x[1], y[1]), dx = (x1 - x0) / width, dy = (y1 - y0) / height;
    svg.append(make_svg("image", {href: canvas.toDataURL(), x: x0, y: y0, width: x1 - x0, height: y1 - y0, preserveAspectRatio: "none"}));
    const place = (a, b) => [x0 + (a + 0.5) * dx, y0 + (b + 0.5) * dy];
    for (const level of levels) {
        const pieces = isolines(values, width, height, level);
        if (!pieces.length) continue;
        const path = make_svg("path", {class: "isoline", d: pieces.map(([a, b, c, e]) => `M${place(a, b).map((v) => v.toFixed(1)).join(" ")}L${place(c, e).map((v) => v.toFixed(1)).join(" ")}`).join("")});
        path.append(make_svg("title", {}, show(level, digits)));
        const [tx, ty] = place(...pieces[Math.floor(pieces.length / 2)]);
        svg.append(path, make_svg("text", {x: Math.min(Math.max(tx, x0 + 16), x1 - 16), y: Math.min(Math.max(ty + 4, y0 + 10), y1 - 4), "text-anchor": "middle", class: "level"}, show(level, digits)));
    }
    return {svg, at, corners: [x0, y0, x1, y1]};
}

/* Curves of one level through samples [height][width], row 0 on top: pieces [x, y, x, y]
 * in samples, by marching squares. */
function isolines(values, width, height, level) {
    const pieces = [], v = (x, y) => values[y * width + x];
    for (let y = 0; y + 1 < height; y++)
        for (let x = 0; x + 1 < width; x++) {
            const corners = [v(x, y), v(x + 1, y), v(x + 1, y + 1), v(x, y + 1)];
            if (!corners.every(is_number)) continue;
            const place = [[x, y], [x + 1, y], [x + 1, y + 1], [x, y + 1]], cuts = [];
            for (let k = 0; k < 4; k++) {
                const a = corners[k] - level, b = corners[(k + 1) % 4] - level;
                if ((a < 0) === (b < 0)) continue;
                const t = a / (a - b), p = place[k], q = place[(k + 1) % 4];
                cuts.push([p[0] + t * (q[0] - p[0]), p[1] + t * (q[1] - p[1])]);
            }
            if (cuts.length === 2) pieces.push([...cuts[0], ...cuts[1]]);
            /* A saddle: the middle tells which corners belong together. */
            else if (cuts.length === 4) {
                const middle = corners.reduce((s, c) => s + c, 0) / 4 - level, turn = (middle < 0) === (corners[0] - level < 0) ? 0 : 1;
                pieces.push([...cuts[turn ? 3 : 0], ...cuts[turn ? 0 : 1]], [...cuts[turn ? 1 : 2], ...cuts[turn ? 2 : 3]]);
            }
        }
    return pieces;
}
