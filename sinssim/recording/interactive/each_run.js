// The runs of an ensemble one by one: their positions at an instant that a slider chooses, with the circles and the
// histogram then; a click on a dot shows the run's curve, seed and command, and a rectangle the statistics of its runs.
"use strict";
(() => {
  const {add} = live;
  const SIDE = 440, EDGE = 46, BARS = 24;

  const four = v => String(Number(v.toPrecision(4))).replace("-", "\u2212");
  const length = m => Math.abs(m) >= 1000 ? `${four(m / 1000)} km` : Math.abs(m) < 1 ? `${four(100 * m)} cm` : `${four(m)} m`;

  async function begin(place) {
    const given = JSON.parse(place.dataset.live), [time, ...rest] = await live.unpack(given), count = given.runs.length;
    if (!count) return;
    place.textContent = "";
    const view = {given, time, north: rest.slice(0, count), east: rest.slice(count), row: time.length - 1, chosen: -1, within: null};
    add(place, "p", "Choose the instant by the slider; click on a dot to see its run, or drag a rectangle around several. With the "
      + "keys \u2190 \u2192 the drawing goes from run to run, from the least error to the largest; R draws a rectangle, which the "
      + "arrows move, and with Shift widen; Escape ends both."
      + (count < given.all ? ` The first ${count} of ${given.all} runs are here; the circles are those of all.` : ""), {class: "note"});
    const label = add(place, "label", "At "), slider = add(label, "input", "", {type: "range", min: 0, max: time.length - 1, step: 1});
    slider.value = view.row;
    view.when = add(label, "output");
    view.words = add(place, "p", "", {"aria-live": "polite"});
    const pair = add(place, "div", "", {class: "pair"});
    view.plane = add(pair, "svg", "", {viewBox: `0 0 ${SIDE} ${SIDE}`, tabindex: 0, role: "group",
      "aria-label": "Positions of the runs: arrow keys choose a run, R draws a rectangle that they move and with Shift widen", class: "plane"});
    view.bars = add(pair, "svg", "", {viewBox: `0 0 ${SIDE} ${SIDE}`, role: "img", "aria-label": "Histogram of the horizontal errors"});
    curve(view, place);
    slider.addEventListener("input", () => { [view.row, view.corners] = [Number(slider.value), null]; show(view); });
    gestures(view);
    show(view);
    live.eachRun = view;
  }

  const error = (view, k, row = view.row) => Math.hypot(view.north[k][row], view.east[k][row]);
  const known = (view, k) => view.north[k][view.row] !== null && view.east[k][view.row] !== null;

  // A copy of the chart of the circles, with the curve of the chosen run.
  function curve(view, place) {
    const figure = live.copy("growth", chart => {
      chart.key = "each run";
      const [like] = chart.curves;
      chart.curves.push({...like, name: "the chosen run", color: "--ink", width: 2, dash: []});
    });
    if (!figure) return;
    add(place, "div", "", {class: "charts"}).append(figure);
    live.add(figure);
    live.draws.push(chart => {
      if (chart.key !== "each run") return;
      view.chart = chart;
      trace(view);
    });
  }

  function trace(view) {
    if (!view.chart) return;
    const {plot, bands, curves, x, y} = view.chart, {chosen, time} = view;
    const data = plot.data.slice(), at = 2 * bands.length + curves.length;
    let k = 0;
    data[at] = plot.data[0].map(place => {
      const t = place * x.size;
      if (chosen < 0) return null;
      while (k < time.length - 2 && time[k + 1] < t) k++;
      const part = (t - time[k]) / (time[k + 1] - time[k]), [a, b] = [k, k + 1].map(row => error(view, chosen, row));
      return (a + part * (b - a)) / y.size;
    });
    const most = Math.max(view.most ??= y.ends[1], ...data[at].map(v => 1.05 * v));
    y.ends = [0, most];
    plot.setData(data);
  }

  function show(view) {
    const {given, time, row, plane, north, east} = view;
    const there = given.runs.map((_, k) => k).filter(k => known(view, k)), radii = given.radii.map(circle => circle[row]);
    view.reach = 1.05 * Math.max(1e-3, ...there.map(k => Math.max(Math.abs(north[k][row]), Math.abs(east[k][row]))), ...radii.map(r => r ?? 0));
    const scale = (SIDE - 2 * EDGE) / 2 / view.reach;
    view.place = k => [SIDE / 2 + scale * east[k][row], SIDE / 2 - scale * north[k][row]];
    view.when.textContent = ` ${four(time[row])} s`;
    plane.textContent = "";
    const middle = SIDE / 2, round = view.reach * 0.95;
    add(plane, "path", "", {d: `M${EDGE} ${middle}H${SIDE - EDGE}M${middle} ${EDGE}V${SIDE - EDGE}`, class: "grid"});
    add(plane, "text", "north", {x: middle, y: EDGE - 8, "text-anchor": "middle"});
    add(plane, "text", `east ${length(round)}`, {x: SIDE - EDGE, y: middle - 6, "text-anchor": "end"});
    radii.forEach((r, n) => {
      if (r === null) return;
      add(plane, "circle", "", {cx: middle, cy: middle, r: scale * r, fill: "none", class: n ? "r95" : "cep"});
      add(plane, "text", `${n ? "R95" : "CEP"} ${length(r)}`, {x: EDGE, y: SIDE - 8 - 16 * (1 - n), class: n ? "r95" : "cep"});
    });
    for (const k of there) {
      const [cx, cy] = view.place(k), inside = view.within?.has(k);
      add(plane, "circle", "", {cx, cy, r: k === view.chosen ? 6 : 3, class: k === view.chosen ? "dot chosen" : inside ? "dot within" : "dot"});
    }
    if (view.corners) frame(view, add(plane, "rect", "", {class: "frame"}));
    histogram(view, there);
    tell(view, there);
  }

  // Draws the rectangle between two corners.
  function frame({corners: [x, y, a, b]}, part) {
    for (const [key, value] of Object.entries({x: Math.min(x, a), y: Math.min(y, b), width: Math.abs(a - x), height: Math.abs(b - y)}))
      part.setAttribute(key, value);
  }

  // Takes the runs in the rectangle, or none without one.
  function enclose(view, corners) {
    const [x, y, a, b] = corners, between = (v, p, q) => (v - p) * (v - q) <= 0;
    const runs = view.given.runs.map((_, k) => k).filter(k => known(view, k));
    Object.assign(view, {corners, chosen: -1});
    view.within = new Set(runs.filter(k => { const [p, q] = view.place(k); return between(p, x, a) && between(q, y, b); }));
    show(view);
    trace(view);
  }

  // The rectangle by keys: R begins it about the chosen run or the middle, the arrows move it, with Shift its far corner.
  function byKeys(view, event) {
    const [across, up] = {ArrowRight: [1, 0], ArrowLeft: [-1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1]}[event.key] ?? [0, 0];
    if (event.key.toLowerCase() === "r") {
      const [x, y] = view.chosen >= 0 ? view.place(view.chosen) : [SIDE / 2, SIDE / 2], half = SIDE / 8;
      enclose(view, [x - half, y + half, x + half, y - half]);
    } else if (view.corners && (across || up)) {
      const [x, y, a, b] = view.corners, step = SIDE / 40;
      const moved = [x + step * across, y + step * up, a + step * across, b + step * up];
      enclose(view, event.shiftKey ? [x, y, ...moved.slice(2)] : moved);
    } else return false;
    event.preventDefault();
    return true;
  }

  function histogram(view, there) {
    const {bars, within} = view, most = Math.max(1e-9, ...there.map(k => error(view, k))), counts = new Array(BARS).fill(0), some = new Array(BARS).fill(0);
    for (const k of there) {
      const bar = Math.min(BARS - 1, Math.floor(BARS * error(view, k) / most));
      counts[bar]++;
      if (within?.has(k)) some[bar]++;
    }
    const wide = (SIDE - 2 * EDGE) / BARS, high = (SIDE - 2 * EDGE) / Math.max(...counts), foot = SIDE - EDGE;
    bars.textContent = "";
    [[counts, "bar"], [some, "bar within"]].forEach(([values, kind]) => values.forEach((value, n) => {
      if (value) add(bars, "rect", "", {x: EDGE + n * wide, y: foot - high * value, width: wide - 1, height: high * value, class: kind});
    }));
    add(bars, "path", "", {d: `M${EDGE} ${foot}H${SIDE - EDGE}`, class: "axis"});
    add(bars, "text", "0", {x: EDGE, y: foot + 16});
    add(bars, "text", length(most), {x: SIDE - EDGE, y: foot + 16, "text-anchor": "end"});
    add(bars, "text", `horizontal error; the highest bar is ${Math.max(...counts)} runs`, {x: EDGE, y: EDGE - 8});
  }

  // Says what is chosen: a run, or the statistics of those in the rectangle.
  function tell(view, there) {
    const {given, chosen, within, words} = view;
    words.textContent = "";
    if (chosen >= 0) {
      const now = known(view, chosen) ? length(error(view, chosen)) : "not known";
      add(words, "span", `Run ${given.runs[chosen]}, seed ${given.seeds[chosen]}, horizontal error ${now}: `);
      add(words, "code", given.commands[chosen]);
    } else if (within) {
      const some = there.filter(k => within.has(k)), {count, north, east, rms, median} = statistics(view, some);
      words.textContent = `${count} of ${there.length} runs`
        + (count ? `: mean ${length(north)} north, ${length(east)} east; root mean square ${length(rms)}, median ${length(median)}.` : ".");
    } else words.textContent = `${there.length} runs.`;
  }

  function statistics(view, some) {
    const count = some.length, mean = values => values.reduce((sum, v) => sum + v, 0) / count;
    const errors = some.map(k => error(view, k)).sort((a, b) => a - b), half = count >> 1;
    return {count, north: mean(some.map(k => view.north[k][view.row])), east: mean(some.map(k => view.east[k][view.row])),
            rms: Math.sqrt(mean(errors.map(v => v * v))), median: count % 2 ? errors[half] : (errors[half - 1] + errors[half]) / 2};
  }

  function choose(view, k) {
    [view.chosen, view.within, view.corners] = [k, null, null];
    show(view);
    trace(view);
  }

  function gestures(view) {
    const {plane} = view;
    const where = event => {
      const box = plane.getBoundingClientRect();
      return [(event.clientX - box.left) * SIDE / box.width, (event.clientY - box.top) * SIDE / box.height];
    };
    let begin = null, part = null;
    plane.addEventListener("pointerdown", event => {
      begin = where(event);
      part = add(plane, "rect", "", {class: "frame"});
      plane.setPointerCapture(event.pointerId);
    });
    plane.addEventListener("pointermove", event => {
      if (!begin) return;
      frame({corners: [...begin, ...where(event)]}, part);
    });
    plane.addEventListener("pointerup", event => {
      if (!begin) return;
      const [first, last] = [begin, where(event)], runs = view.given.runs.map((_, k) => k).filter(k => known(view, k));
      begin = null;
      if (Math.hypot(last[0] - first[0], last[1] - first[1]) < 5) {
        const away = k => Math.hypot(...view.place(k).map((v, n) => v - last[n]));
        const near = runs.reduce((best, k) => away(k) < away(best) ? k : best, runs[0]);
        choose(view, away(near) < 15 ? near : -1);
      } else enclose(view, [...first, ...last]);
    });
    plane.addEventListener("keydown", event => {
      if (byKeys(view, event)) return;
      const step = {ArrowRight: 1, ArrowUp: 1, ArrowLeft: -1, ArrowDown: -1}[event.key];
      if (event.key === "Escape") choose(view, -1);
      if (!step) return;
      event.preventDefault();
      const order = view.given.runs.map((_, k) => k).filter(k => known(view, k)).sort((a, b) => error(view, a) - error(view, b));
      const now = order.indexOf(view.chosen);
      choose(view, order[now < 0 ? (step > 0 ? 0 : order.length - 1) : Math.min(Math.max(now + step, 0), order.length - 1)]);
    });
  }

  live.parts.each_run = begin;
})();
