/* SPDX-License-Identifier: Apache-2.0
 *
 * A page that is served while work goes on (importon view): its server's events, a slider
 * for each number, and what the server can be asked for. */
"use strict";

/* ---- Sliders -------------------------------------------------------------------------- */

/* The range of a slider: the bounds, or four times the start about it; of places and angles what
 * the server says. */
function slider_range(n) {
    const size = Math.max(Math.abs(n.start), Math.abs(n.value)) || 1;
    if (n.reach > 0) return [Math.max(n.start - n.reach, is_number(n.min) ? n.min : -Infinity), Math.min(n.start + n.reach, is_number(n.max) ? n.max : Infinity)];
    const lo = is_number(n.min) ? n.min : -4 * size, hi = is_number(n.max) ? n.max : 4 * size;
    return is_number(n.min) && is_number(n.max) ? [lo, hi] : is_number(n.min) ? [lo, Math.max(hi, lo + 4 * size)] : is_number(n.max) ? [Math.min(lo, hi - 4 * size), hi] : [lo, hi];
}

function slider_of(n, moved) {
    const id = `number-${n.name}`, [lo, hi] = slider_range(n);
    const slider = make("input", {type: "range", id, min: lo, max: hi, step: (hi - lo) / 1000, value: n.value});
    const field = make("input", {type: "number", step: "any", class: "mono field", "aria-label": `${n.name}, as a number`, value: Number(n.value.toPrecision(6))});
    if (is_number(n.min)) field.min = n.min;
    if (is_number(n.max)) field.max = n.max;
    slider.addEventListener("input", () => { field.value = Number(Number(slider.value).toPrecision(6)); moved(n.name, Number(slider.value)); });
    field.addEventListener("change", () => { if (field.value !== "" && field.checkValidity()) { slider.value = field.value; moved(n.name, Number(field.value)); } });
    const row = make("div", {class: "slider"}, make("label", {for: id, class: "mono"}, n.name), slider, field, make("span", {class: "faint"}, n.unit === "1" || !n.unit ? "" : n.unit));
    return {row, name: n.name, value() { return Number(field.value); },
        move(to) { field.value = Number(to.toPrecision(6)); slider.value = field.value; moved(n.name, Number(field.value)); },
        set(value) { if (document.activeElement !== slider && document.activeElement !== field) { slider.value = value; field.value = Number(value.toPrecision(6)); } },
        enable(on) { slider.disabled = field.disabled = !on; }};
}

/* ---- The section ------------------------------------------------------------------------ */

function live_section(report, page) {
    const state = {now: {state: "", what: ""}, sliders: [], waiting: null};
    const said = make("p", {role: "status", id: "state"}, "Waiting for news."), bar = make("progress", {max: 1, value: 0, "aria-label": "progress"}), note = make("span", {class: "faint mono"});
    const button = (what, text) => make("button", {type: "button", id: `do-${what}`, click: () => ask(what)}, text);
    const stop = button("stop", "stop"), go = button("go", "resume"), again = button("again", "fit from here"), save = button("save", "save");
    const numbers = make("div", {class: "sliders"});
    const events = new EventSource("events");
    async function ask(what, more = {}) {
        try {
            const answer = await fetch(`act?${new URLSearchParams({do: what, ...more})}`, {method: "POST"});
            if (!answer.ok) said.textContent = await answer.text();
        } catch (error) {
            said.textContent = "importon has ended; this is the last that it told.";
        }
    }
    /* A slider sends its last value, and not more than one every 60 ms. */
    const pending = new Map();
    function moved(name, value) {
        pending.set(name, value);
        if (state.waiting) return;
        state.waiting = setTimeout(() => {
            state.waiting = null;
            for (const [n, v] of pending) ask("set", {name: n, value: v});
            pending.clear();
        }, 60);
    }
    function enable() {
        const {state: s, what} = state.now, running = s === "running", follows = what === "render" || what === "rays";
        stop.disabled = !running;
        go.disabled = s !== "stopped" || what === "rays";
        again.hidden = !state.now.again;
        again.disabled = running;
        save.hidden = !state.now.target;
        for (const slider of state.sliders) slider.enable(follows || !running);
    }
    const on = (name, act) => events.addEventListener(name, (e) => act(JSON.parse(e.data)));
    on("state", (s) => {
        state.now = s;
        page.live.walks = s.walks;
        said.textContent = `${s.what}: ${s.state}${s.message ? ` (${s.message})` : ""}`;
        save.title = s.target ? `to ${s.target}` : "";
        if (s.state !== "running") { bar.value = s.state === "done" ? 1 : 0; note.textContent = ""; }
        enable();
    });
    on("progress", (p) => {
        bar.value = is_number(p.fraction) ? p.fraction : 0;
        note.textContent = [p.stage, is_number(p.eta_s) ? `${show(p.eta_s, 2)} s to go` : "", p.note || ""].filter(Boolean).join(" · ");
    });
    on("numbers", (all) => {
        if (all.length !== state.sliders.length) {
            state.sliders = all.map((n) => slider_of(n, moved));
            numbers.replaceChildren(...state.sliders.map((s) => s.row));
        }
        all.forEach((n, i) => { if (is_number(n.value) && !pending.has(n.name)) state.sliders[i].set(n.value); });
        enable();
    });
    /* What a page is too slow for is not shown: of items that take each other's place the
     * last. */
    const key = (i) => (i.kind === "walks" ? i.kind : [i.kind, i.name, i.role, i.view].join("\n"));
    const waiting = new Map();
    let busy = false;
    on("report", async (part) => {
        for (const item of part.items) waiting.set(key(item), item);
        if (busy) return;
        busy = true;
        while (waiting.size) {
            const items = [...waiting.values()];
            waiting.clear();
            try {
                await unpack(items);
                take({items});
            } catch (error) {
                said.textContent = String(error.message || error);
            }
            await new Promise((next) => setTimeout(next)); /* news first */
        }
        busy = false;
    });
    function take(part) {
        const kinds = [...new Set(part.items.map((i) => i.kind))];
        for (const item of part.items) {
            const at = report.items.findIndex((i) => key(i) === key(item));
            if (at >= 0) report.items[at] = item;
            else report.items.push(item);
        }
        page.update(kinds);
        document.documentElement.dataset.news = String(Number(document.documentElement.dataset.news || 0) + 1);
    }
    events.onerror = () => { said.textContent = events.readyState === 2 ? "importon has ended; this is the last that it told." : "The connection is lost; trying again."; };
    /* Things are dragged where sliders could be moved: held() has their numbers as they are, and the
     * function that it returns shifts these by v. */
    const follows = () => state.now.what === "render" || state.now.state !== "running";
    function held(place) {
        const sliders = place.shifts.map((number) => state.sliders.find((s) => s.name === `${place.name}[${number}]`));
        const start = sliders.map((s) => (s ? s.value() : 0));
        return (v) => sliders.forEach((s, k) => { if (s) s.move(start[k] + v[k]); });
    }
    page.live = {ask, walks: false, movable: follows, held};
    enable();
    return make("section", {id: "live", class: "noprint"}, said, make("div", {class: "bar"}, bar, note), make("div", {class: "bar", role: "toolbar", "aria-label": "run"}, stop, go, again, save), numbers);
}
