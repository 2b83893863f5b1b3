/* SPDX-License-Identifier: Apache-2.0
 *
 * Parameters with their intervals, correlations, the loss by iteration, checks, and how
 * the result was made. */
"use strict";

const rows_shown = 200; /* a table of a million rows helps nobody: the rest is searched */

/* ---- Parameters ----------------------------------------------------------------------- */

/* Marks on an axis from lo to hi at height y: the interval, the start, what is true, the value. */
function axis_marks(svg, p, y, at, inside) {
    svg.append(make_svg("line", {x1: 6, y1: y, x2: 214, y2: y, class: "axis"}));
    if (is_number(p.lo95) && is_number(p.hi95))
        svg.append(make_svg("rect", {x: at(p.lo95), y: y - 5, width: Math.max(at(p.hi95) - at(p.lo95), 1.5), height: 10, class: "band"}));
    if (is_number(p.start) && inside(p.start)) svg.append(make_svg("line", {x1: at(p.start), y1: y - 7, x2: at(p.start), y2: y + 7, class: "mark"}));
    if (is_number(p.truth) && inside(p.truth)) svg.append(make_svg("path", {d: `M${at(p.truth)} ${y - 6}l4 6l-4 6l-4 -6Z`, class: "true"}));
    if (is_number(p.value)) svg.append(make_svg("circle", {cx: at(p.value), cy: y, r: 3.5, fill: "var(--accent)"}));
}

/* Start, value and interval on one axis; the bounds of the parameter are its ends where
 * they are near. An interval far narrower than the way from the start has a second axis, below. */
function interval_bar(p) {
    const known = [p.start, p.value, p.lo95, p.hi95, p.truth].filter(is_number), all = () => true;
    let lo = Math.min(...known), hi = Math.max(...known);
    const width = p.hi95 - p.lo95, close = known.length > 1 && is_number(p.lo95) && is_number(p.hi95) && width > 0 && width < 0.05 * (hi - lo), height = close ? 48 : 20;
    const svg = make_svg("svg", {width: 220, height, viewBox: `0 0 220 ${height}`, role: "img", "aria-label": close ? "interval, and again on an axis of its own" : "interval"});
    if (known.length < 2) return svg;
    const margin = (hi - lo || Math.abs(hi) || 1) * 0.1;
    [lo, hi] = [lo - margin, hi + margin];
    if (is_number(p.min)) lo = Math.max(lo, p.min);
    if (is_number(p.max)) hi = Math.min(hi, p.max);
    if (!(hi > lo)) return svg;
    const scale = (lo, hi) => (v) => 6 + 208 * Math.min(Math.max((v - lo) / (hi - lo), 0), 1), at = scale(lo, hi);
    const then = make_svg("circle", {cx: 0, cy: 10, r: 5, class: "then", visibility: "hidden"});
    svg.at_iteration = (v) => { then.setAttribute("visibility", is_number(v) ? "visible" : "hidden"); if (is_number(v)) then.setAttribute("cx", at(v)); };
    if (close) {
        const near = is_number(p.truth) && p.truth > p.lo95 - 3 * width && p.truth < p.hi95 + 3 * width ? p.truth : p.value;
        const from = Math.min(p.lo95, near) - width / 4, to = Math.max(p.hi95, near) + width / 4;
        svg.append(make_svg("path", {d: `M${at(from)} 16L6 30M${at(to)} 16L214 30`, class: "zoom"}));
        axis_marks(svg, p, 38, scale(from, to), (v) => v >= from && v <= to);
    }
    axis_marks(svg, p, 10, at, all);
    svg.append(then);
    return svg;
}

function percent(x) { return `${x >= 0.995 ? Math.round(100 * x) : show(100 * x, 2)} %`; }

function state_of(p) {
    if (p.determined === false) return ["not determined by the pictures", "warn"];
    if (p.at_bound < 0) return ["at its lower bound", "warn"];
    if (p.at_bound > 0) return ["at its upper bound", "warn"];
    return ["", ""];
}

/* Many numbers of one parameter: their range, and those that are least certain. */
function field_summary(p) {
    const least = Array.isArray(p.least_certain) ? p.least_certain : [];
    return make("div", {class: "field"}, make("h3", {class: "mono"}, String(p.name)),
        make("p", {}, `${p.count} numbers${p.file ? `, drawn from ${p.file}` : ""}${is_number(p.least) ? `: ${show(p.least, 4)} to ${show(p.most, 4)}, mean ${show(p.mean, 4)}` : ""}${p.n_at_bound > 0 ? `; ${p.n_at_bound} at a bound` : ""}. `
            + (p.n_intervals > 0 ? `${p.n_intervals} have intervals, whose half width is the picture "${p.name}.interval".` : "They have no intervals: there are too many numbers, or none were asked for.")),
        least.length ? make("p", {}, "Least certain:") : null,
        least.length ? make("div", {class: "scroll"}, make("table", {}, make("tbody", {}, ...least.map((v) => make("tr", {}, make("td", {class: "mono"}, String(v.name)), make("td", {}, show_error(v.value, v.se)),
            make("td", {}, is_number(v.lo95) ? `${show(v.lo95)} to ${show(v.hi95)}` : "–")))))) : null);
}

function parameter_section(fit) {
    const numbers = fit.params.filter((p) => p.name !== undefined && p.file === undefined);
    const truth = numbers.some((p) => is_number(p.truth));
    const files = fit.params.filter((p) => p.file !== undefined);
    const body = make("tbody"), told = make("p", {class: "faint"});
    let rows = [];
    /* While an iteration is looked at, values are those of then, and a ring is where they were. */
    document.addEventListener("iteration", (e) => {
        if (!body.isConnected) return;
        for (const row of rows) {
            const then = e.detail ? e.detail.at.get(row.name) : undefined;
            row.value.textContent = show(is_number(then) ? then : row.p.value);
            row.value.className = is_number(then) ? "then" : "";
            if (row.bar.at_iteration) row.bar.at_iteration(then);
        }
        body.className = e.detail ? "of-then" : ""; /* the other columns are of the answer */
        heading.textContent = e.detail ? `value at iteration ${e.detail.iteration}` : "value";
    });
    const heading = make("th", {scope: "col"}, "value");
    function fill(pattern) {
        rows = [];
        const match = numbers.filter((p) => String(p.name).toLowerCase().includes(pattern.toLowerCase()));
        body.replaceChildren(...match.slice(0, rows_shown).map((p) => {
            const [text, colour] = state_of(p), relative = is_number(p.se) && p.value ? Math.abs(p.se / p.value) : NaN;
            const bar = interval_bar(p), value = make("td", {}, show(p.value));
            rows.push({name: String(p.name), bar, value, p});
            return make("tr", {}, make("td", {class: "mono"}, String(p.name)), make("td", {}, show(p.start)),
                value, make("td", {}, show(p.se, 2)),
                make("td", {}, is_number(relative) ? percent(relative) : "–"),
                make("td", {}, is_number(p.lo95) ? `${show(p.lo95)} to ${show(p.hi95)}` : text ? "" : "–",
                    text ? make("div", {class: `note ${colour}`}, text) : null),
                truth ? make("td", {}, show(p.truth)) : null, make("td", {}, bar), make("td", {class: "unit"}, p.unit === "1" ? "" : p.unit || ""));
        }));
        told.textContent = match.length > rows_shown ? `${rows_shown} of ${match.length} are shown; the field above finds others.` : "";
    }
    const find = make("input", {type: "search", "aria-label": "find a parameter", placeholder: "find a parameter", input: () => fill(find.value)});
    fill("");
    const least = numbers.filter((p) => is_number(p.se) && p.value).sort((a, b) => Math.abs(b.se / b.value) - Math.abs(a.se / a.value))[0];
    const missing = numbers.filter((p) => p.determined === false);
    return make("section", {id: "parameters"}, make("h2", {}, "Parameters"),
        missing.length ? make("p", {class: "warning"}, `The pictures do not determine ${missing.length} of ${numbers.length} numbers: ${missing.slice(0, 5).map((p) => p.name).join(", ")}${missing.length > 5 ? ", ..." : ""}.`) : null,
        least ? make("p", {}, `Least certain, relative to its value: ${least.name}, ± ${percent(Math.abs(least.se / least.value))} (one standard error).`) : null,
        numbers.length > 12 ? make("div", {class: "bar noprint"}, find) : null,
        numbers.length ? make("div", {class: "scroll"}, make("table", {}, make("thead", {}, make("tr", {},
            ...["name", "start", "value", "se", "relative", "95 % interval", ...(truth ? ["truth"] : []), truth ? "start (tick), value (dot), truth (diamond)" : "start (tick), value (dot), interval", "unit"].map((t, i) =>
                (i === 2 ? heading : make("th", {class: t === "unit" ? "text" : null, scope: "col"}, t))))), body)) : make("p", {}, "No single numbers were fitted."),
        told, ...files.map(field_summary));
}

/* ---- Correlations --------------------------------------------------------------------- */

function correlation_section(fit) {
    const c = fit.covariance, names = fit.params.filter((p) => p.file === undefined).map((p) => String(p.name)), n = names.length;
    if (!Array.isArray(c) || c.length !== n || n < 2 || n > 60) return null;
    const r = c.map((row, i) => row.map((v, j) => v / Math.sqrt(c[i][i] * c[j][j])));
    const cell = n > 24 ? 16 : 30, left = Math.min(260, 8 * Math.max(...names.map((s) => s.length)) + 30), size = n * cell;
    const svg = make_svg("svg", {width: left + size + 10, height: size + 20 + 10, viewBox: `0 0 ${left + size + 10} ${size + 30}`, role: "img", "aria-label": "correlations"});
    let worst = null;
    const tied = [];
    r.forEach((row, i) => {
        svg.append(make_svg("text", {x: left - 6, y: 20 + cell * i + cell / 2 + 4, "text-anchor": "end"}, (names[i].length > 28 ? names[i].slice(0, 27) + "…" : names[i]) + ` ${i + 1}`));
        svg.append(make_svg("text", {x: left + cell * (i + 0.5), y: 14, "text-anchor": "middle"}, String(i + 1)));
        row.forEach((v, j) => {
            if (!is_number(v)) return;
            if (j < i && Math.abs(v) > 0.99) tied.push([j, i]);
            if (j < i && (!worst || Math.abs(v) > Math.abs(worst.v))) worst = {v, i, j};
            const rect = make_svg("rect", {x: left + cell * j, y: 20 + cell * i, width: cell - 1, height: cell - 1, fill: `rgb(${signed_colour(v).map(Math.round).join(",")})`});
            rect.append(make_svg("title", {}, `${names[i]}, ${names[j]}: ${show(v, 3)}`));
            svg.append(rect);
            if (cell >= 30) {
                const text = make_svg("text", {x: left + cell * (j + 0.5), y: 20 + cell * (i + 0.5) + 4, "text-anchor": "middle", style: `fill: ${v < -0.62 ? "#fff" : "#000"}; font-size: 10px`}, v.toFixed(2).replace("0.", "."));
                svg.append(text);
            }
        });
    });
    const also = tied.filter(([j, i]) => i !== worst.i || j !== worst.j).map(([j, i]) => `${names[i]} and ${names[j]}`);
    return make("section", {id: "correlations"}, make("h2", {}, "Correlations of the errors"),
        worst && Math.abs(worst.v) > 0.9 ? make("p", {class: "warning"}, `${names[worst.i]} and ${names[worst.j]} are hard to tell apart: correlation ${show(worst.v, 3)}${also.length ? `; so are ${also.slice(0, 3).join(", ")}${also.length > 3 ? ` and ${also.length - 3} more pairs` : ""}` : ""}.`) : null,
        make("div", {class: "scroll"}, svg));
}

/* ---- The loss -------------------------------------------------------------------------- */

/* y as asinh(y / (2 unit)): logarithmic far above the errors, linear among them, since an
 * unbiased loss may be negative. */
function loss_section(fit) {
    const h = fit.history;
    if (!h || !Array.isArray(h.loss) || h.loss.length < 1) return null;
    const se = Array.isArray(h.se) ? h.se : [], n = h.loss.length, w = 720, ht = 300, left = 84, bottom = 44, top = 14, right = 16;
    const finite = h.loss.filter(is_number);
    if (!finite.length) return null;
    const errors = se.filter((s) => is_number(s) && s > 0);
    const least_of = (v, start) => v.reduce((a, b) => Math.min(a, b), start), most_of = (v, start) => v.reduce((a, b) => Math.max(a, b), start);
    const answer = is_number(fit.value), stops = answer ? n : n - 1; /* the answer stands behind the last iteration */
    const band = (sign) => [...h.loss, fit.value].map((v, i) => v + sign * ([...se.slice(0, n), ...Array(Math.max(0, n - se.length)).fill(0), fit.se][i] || 0)).filter(is_number);
    const largest = most_of([...finite, fit.value].filter(is_number).map(Math.abs), 0) || 1;
    const unit = Math.max(errors.length ? least_of(errors, Infinity) : largest * 1e-6, largest * 1e-8);
    const hi = 1.1 * most_of(band(1), unit), lo = least_of(band(-1), 0) - 0.2 * unit;
    const bend = (y) => Math.asinh(y / (2 * unit));
    const y_at = (y) => ht - bottom - (ht - bottom - top) * (bend(Math.min(Math.max(y, lo), hi)) - bend(lo)) / (bend(hi) - bend(lo));
    const x_at = (i) => left + (w - left - right) * (stops > 0 ? i / stops : 0.5);
    const svg = make_svg("svg", {width: w, height: ht, viewBox: `0 0 ${w} ${ht}`, role: "img", "aria-label": "loss by iteration"});
    const levels = [];
    const level = (v) => { /* where its number has room */
        if (v < lo || v > hi || levels.some((y) => Math.abs(y - y_at(v)) < 14)) return;
        levels.push(y_at(v));
        svg.append(make_svg("line", {x1: left, x2: w - right, y1: y_at(v), y2: y_at(v), class: "axis"}),
            make_svg("text", {x: left - 8, y: y_at(v) + 4, "text-anchor": "end"}, show(v, 2)));
    };
    level(0);
    const first = Math.ceil(Math.log10(unit)), last = Math.log10(hi), step = Math.max(1, Math.ceil((last - first) / 8));
    for (let k = first; k <= last; k += step) level(10 ** k);
    if (last - first < 2) level(3 * 10 ** (first - 1));
    if (lo < -unit) level(-(10 ** Math.floor(Math.log10(-lo))));
    const stride = Math.max(1, 10 ** Math.floor(Math.log10(Math.max(n - 1, 1) / 4)));
    const each = [1, 2, 5, 10].map((m) => m * stride).find((m) => (n - 1) / m <= 10) || 10 * stride;
    for (let i = 0; i < n; i += each) svg.append(make_svg("text", {x: x_at(i), y: ht - bottom + 18, "text-anchor": "middle"}, String(i)));
    svg.append(make_svg("text", {x: (left + w - right) / 2, y: ht - 8, "text-anchor": "middle"}, "iteration"),
        make_svg("text", {transform: `translate(14 ${(top + ht - bottom) / 2}) rotate(-90)`, "text-anchor": "middle"}, fit.loss ? `loss (${fit.loss})` : "objective"));
    if (se.length === n && n > 1) {
        const ok = h.loss.map((v, i) => i).filter((i) => is_number(h.loss[i]) && is_number(se[i]));
        const up = ok.map((i) => `${x_at(i).toFixed(1)} ${y_at(h.loss[i] + se[i]).toFixed(1)}`);
        const down = ok.map((i) => `${x_at(i).toFixed(1)} ${y_at(h.loss[i] - se[i]).toFixed(1)}`).reverse();
        svg.append(make_svg("path", {class: "band", d: `M${[...up, ...down].join("L")}Z`}));
    }
    const points = h.loss.map((v, i) => [v, i]).filter(([v]) => is_number(v));
    svg.append(make_svg("path", {class: "curve", d: `M${points.map(([v, i]) => `${x_at(i).toFixed(1)} ${y_at(v).toFixed(1)}`).join("L")}`}));
    for (const [v, i] of points.length < 60 ? points : [])
        svg.append(make_svg("circle", {cx: x_at(i), cy: y_at(v), r: 3, fill: "var(--accent)"}));
    if (answer) {
        if (is_number(fit.se)) svg.append(make_svg("line", {x1: x_at(n), x2: x_at(n), y1: y_at(fit.value - fit.se), y2: y_at(fit.value + fit.se), class: "curve"}));
        svg.append(make_svg("circle", {cx: x_at(n), cy: y_at(fit.value), r: 4, fill: "var(--accent)"}), make_svg("text", {x: x_at(n), y: ht - bottom + 18, "text-anchor": "end"}, "answer"));
    }
    const cursor = make_svg("line", {y1: top, y2: ht - bottom, class: "mark"});
    svg.append(cursor);
    const told = make("p", {class: "mono", "aria-live": "polite"});
    const slider = make("input", {type: "range", min: 0, max: n, value: n, "aria-label": "iteration, and the answer behind the last", input: () => go(Number(slider.value))});
    /* Stops 0 to n - 1 are iterations, n is the answer. */
    function go(i) {
        const at = x_at(Math.min(i, stops));
        cursor.setAttribute("x1", at);
        cursor.setAttribute("x2", at);
        slider.setAttribute("aria-valuetext", i < n ? `iteration ${i}` : "the answer");
        told.textContent = i < n ? `iteration ${i} of ${n - 1}: loss ${show_error(h.loss[i], se[i])}` : `the answer, after all iterations: loss ${show_error(fit.value, fit.se)}`;
        const x = i < n && h.x ? h.x[i] : null, names = h.names || [];
        document.dispatchEvent(new CustomEvent("iteration", {detail: Array.isArray(x) ? {iteration: i, at: new Map(x.map((v, k) => [String(names[k]), v]))} : null}));
    }
    go(n);
    return make("section", {id: "loss"}, make("h2", {}, "Loss"), make("div", {class: "scroll"}, svg),
        make("p", {class: "faint"}, `The band is one standard error.${lo < -unit ? " A loss may be below 0: the noise of its own samples is taken off, so that it is right on average." : ""}`),
        n > 1 ? make("div", {class: "bar noprint"}, make("label", {}, "iteration ", slider), Array.isArray(h.x) ? make("span", {class: "faint"}, "values in the table of parameters move with it") : null) : null, told,
        Array.isArray(h.x) && n > 1 ? make("p", {class: "faint"}, `All ${h.x[0].length} numbers by iteration, and the answer with its 95 % interval:`) : null,
        Array.isArray(h.x) && n > 1 ? make("div", {class: "traces"}, ...trace_figures(h, fit.params)) : null);
}

/* Each number by iteration, and the answer behind the last; a history has those of at most
 * 64. */
function trace_figures(h, params) {
    const answers = new Map((Array.isArray(params) ? params : []).map((p) => [String(p.name), p]));
    const names = Array.isArray(h.names) ? h.names : [], n = h.x.length, of = (k) => h.x.map((row) => row[k]);
    return h.x[0].slice(0, rows_shown).map((_, k) => {
        const p = answers.get(String(names[k])) || {}, ends = [p.lo95, p.hi95].filter(is_number), known = is_number(p.value);
        const v = of(k), finite = [...v, ...ends, p.value].filter(is_number), lo = Math.min(...finite), hi = Math.max(...finite), margin = 0.06 * (hi - lo) || Math.abs(hi) * 0.05 || 1;
        if (!finite.length) return null;
        const {svg, at} = plot_axes({width: 300, height: 150, x: [0, known ? n : n - 1], y: [lo - margin, hi + margin], label: `${names[k] ?? k} by iteration`, left: 60});
        svg.append(make_svg("path", {class: "curve", d: `M${v.map((y, i) => (is_number(y) ? at(i, y).map((c) => c.toFixed(1)).join(" ") : "")).filter(Boolean).join("L")}`}));
        if (known && ends.length === 2) svg.append(make_svg("line", {x1: at(n, p.value)[0], x2: at(n, p.value)[0], y1: at(n, ends[0])[1], y2: at(n, ends[1])[1], class: "curve"}));
        if (known) svg.append(make_svg("circle", {cx: at(n, p.value)[0], cy: at(n, p.value)[1], r: 3.5, fill: "var(--accent)"}));
        return make("figure", {}, make("figcaption", {class: "mono"}, String(names[k] ?? k)), svg);
    });
}

/* ---- Checks and provenance --------------------------------------------------------------- */

function check_section(check) {
    const rows = Array.isArray(check.rows) ? check.rows : [], bad = rows.filter((r) => r.ok === false && r.resolved !== false);
    return make("section", {id: "check"}, make("h2", {}, "Checks of the gradient"),
        make("p", {class: bad.length ? "error" : ""}, bad.length ? `${bad.length} of ${rows.length} rows disagree.` : `${rows.length} rows; none disagrees.`),
        make("div", {class: "scroll"}, make("table", {}, make("thead", {}, make("tr", {},
            ...["method", "parameter", "step", "derivative", "reference", "error", "limit", ""].map((t) => make("th", {scope: "col"}, t)))),
            make("tbody", {}, ...rows.slice(0, rows_shown).map((r) => {
                const [text, colour] = r.resolved === false ? ["too noisy to tell", "warn"] : r.ok === false ? ["disagrees", "bad"] : ["agrees", "good"];
                return make("tr", {}, make("td", {}, String(r.method)), make("td", {class: "mono text"}, String(r.param)), make("td", {}, show(r.step, 2)),
                    make("td", {}, show(r.value)), make("td", {}, show(r.reference)),
                    make("td", {}, `${show(r.error, 3)}${r.se > 0 ? " se" : ""}`), make("td", {}, show(r.limit, 2)), make("td", {class: `text ${colour}`}, text));
            })))));
}

/* ---- Answers of other commands, and drawings ----------------------------------------------- */

/* Numbers and words in one table; lists of objects in one each. */
function answer_section(item) {
    const flat = [], lists = [];
    const walk = (value, path) => {
        if (Array.isArray(value) && value.length && value.every((v) => v && typeof v === "object" && !Array.isArray(v))) lists.push([path, value]);
        else if (Array.isArray(value)) flat.push([path, value.slice(0, 12).map((v) => (is_number(v) ? show(v) : String(v))).join(", ") + (value.length > 12 ? ", ..." : "")]);
        else if (value && typeof value === "object") for (const [k, v] of Object.entries(value)) walk(v, path ? `${path}.${k}` : k);
        else flat.push([path, is_number(value) ? show(value) : value === null ? "–" : String(value)]);
    };
    walk(item.data, "");
    const cell = (v) => (is_number(v) ? show(v) : Array.isArray(v) ? v.map((x) => (is_number(x) ? show(x, 4) : String(x))).join(", ") : v === null || v === undefined ? "–" : String(v));
    return make("section", {}, make("h2", {}, [item.kind, item.name].filter(Boolean).join(": ")),
        make("table", {}, make("tbody", {}, ...flat.slice(0, rows_shown).map(([k, v]) => make("tr", {}, make("td", {}, k), make("td", {class: "text"}, v))))),
        ...lists.map(([path, rows]) => {
            const keys = Object.keys(rows[0]).filter((k) => typeof rows[0][k] !== "object" || Array.isArray(rows[0][k])).slice(0, 12);
            return make("div", {class: "scroll"}, make("p", {class: "faint"}, rows.length > rows_shown ? `${path}: ${rows_shown} of ${rows.length}` : path),
                make("table", {}, make("thead", {}, make("tr", {}, ...keys.map((k) => make("th", {scope: "col"}, k)))),
                    make("tbody", {}, ...rows.slice(0, rows_shown).map((r) => make("tr", {}, ...keys.map((k) => make("td", {}, cell(r[k]))))))));
        }));
}

/* Files that browsers draw; an image cannot run scripts. */
function image_section(items) {
    return make("section", {id: "images"}, make("h2", {}, "Drawings"), make("div", {class: "drawings"}, ...items.map((i) =>
        make("figure", {}, make("img", {src: `data:${i.type};base64,${i.file}`, alt: i.name || "", loading: "lazy"}), make("figcaption", {}, i.name || "")))));
}

function provenance_section(command, report, items) {
    const facts = new Map([["made by", `importon ${report.importon}`]]);
    for (const item of items) {
        const d = item.data;
        if (item.kind === "fit" && d)
            for (const key of ["optimizer", "loss", "seed", "spp", "spp_taken", "iterations"])
                if (d[key] !== undefined && d[key] !== null) facts.set(key.replace("_", " "), String(d[key]));
        if (item.kind === "manifest" && d)
            for (const [key, value] of Object.entries(d))
                if (typeof value !== "object") facts.set(key.replace(/_/g, " "), String(value));
    }
    const copy = command ? make("button", {type: "button", class: "noprint", click: () => {
        const done = () => { copy.textContent = "copied"; };
        if (navigator.clipboard) navigator.clipboard.writeText(command).then(done, select);
        else select();
    }}, "copy the command") : null;
    const text = make("code", {}, command || "");
    function select() { getSelection().selectAllChildren(text); }
    return make("section", {id: "provenance"}, make("h2", {}, "How it was made"),
        command ? make("p", {}, text) : null, copy,
        make("table", {}, make("tbody", {}, ...[...facts].map(([k, v]) => make("tr", {}, make("td", {}, k), make("td", {class: "text mono"}, v))))));
}
