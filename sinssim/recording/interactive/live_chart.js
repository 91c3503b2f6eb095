// Draws the curves of a page with uPlot from the data beside their still pictures: dragging zooms, a double click shows
// all again, the legend reads the values at the cursor and hides curves. Charts over time show the same part of it, and
// their cursor is at the same instant, as is the mark on the map.
"use strict";
const live = (() => {
  const FONT = '12px system-ui, "Segoe UI", "Liberation Sans", Arial, sans-serif';
  const LETTER = 6.6, RIGHT = 14, LEAST = 130; // px: of a number's character, beside the curves, height of a chart
  const STEPS = [];
  for (let power = -15; power < 16; power++) for (const n of [1, 2, 5]) STEPS.push(Number(`${n}e${power}`));

  const drawn = []; // the charts of the page that were in sight
  let part = null; // the time that all charts over time show, s; null for all
  let due = false; // whether the page is about to draw another part
  // draws: called with each chart once it is drawn; spots: called with the instant of the cursor, s or null;
  // parts: draw the other parts of a page that answer the reader
  const shared = {drawn, draws: [], parts: {}, spots: []};

  const css = name => name.startsWith("--")
    ? getComputedStyle(document.documentElement).getPropertyValue(name).trim() : name;
  const signed = text => text.replace(/-/g, "\u2212");

  const inflate = text => new Response(new Blob([Uint8Array.from(atob(text), c => c.charCodeAt(0))])
    .stream().pipeThrough(new DecompressionStream("deflate-raw")));

  // The arrays of a chart: from the differences of their bits, by planes of bytes, as Python's _packed writes them.
  async function unpack({numbers, counts}) {
    const planes = new Uint8Array(await inflate(numbers).arrayBuffer());
    const all = planes.length / 4;
    let at = 0;
    return counts.map(count => {
      const bits = new Int32Array(count);
      for (let k = 0, last = 0; k < count; k++, at++) {
        const step = planes[at] | planes[all + at] << 8 | planes[2 * all + at] << 16 | planes[3 * all + at] << 24;
        bits[k] = last = last + (step >>> 1 ^ -(step & 1)) | 0;
      }
      return Array.from(new Float32Array(bits.buffer), v => Number.isNaN(v) ? null : v);
    });
  }

  // A number with the digits that tell it from its neighbours at a distance.
  function tick(value, step) {
    if (Math.max(Math.abs(value), step) >= 1e6 || step < 1e-4) return signed(String(Number(value.toPrecision(3))));
    const places = Math.max(0, -Math.floor(Math.log10(step) + 1e-9));
    return signed((Math.abs(value) < 1e-6 * step ? 0 : value).toFixed(places));
  }

  // The numbers on a logarithmic axis: powers of ten, between few of them 2 and 5 as well.
  function decades(low, high) {
    const wide = Math.log10(high / low), many = wide > 2.5, leap = Math.max(1, Math.ceil(wide / 10)), found = [];
    for (let power = Math.floor(Math.log10(low)); power <= Math.log10(high) + 1; power++) {
      for (const n of many ? [1] : [1, 2, 5]) {
        const at = Number(`${n}e${power}`);
        if (at > 0.999 * low && at < 1.001 * high && power % leap === 0) found.push(at);
      }
    }
    return found;
  }
  const power = at => signed(at >= 1e-4 && at < 1e6 ? String(at) : at.toExponential(0));

  const reading = (value, unit) => value === null || value === undefined
    ? "–" : signed(String(Number(value.toPrecision(5)))) + (unit ? "\u00a0" + unit : "");

  // The values of the curves on common places; one curve may have several values at a place, which stay in order.
  function table(curves, arrays) {
    const places = new Map();
    curves.forEach((curve, k) => {
      if (!places.has(curve.x)) places.set(curve.x, {x: arrays[curve.x].slice(), of: []});
      places.get(curve.x).of.push(k);
    });
    const groups = [...places.values()];
    for (const {x} of groups) {
      const hair = 1e-9 * Math.abs(x[x.length - 1] - x[0]) || 1e-12;
      for (let k = 1; k < x.length; k++) if (x[k] <= x[k - 1]) x[k] = x[k - 1] + hair;
    }
    const columns = groups.map(({x, of}) => [x, ...of.map(k => arrays[curves[k].y])]);
    const joined = columns.length > 1 ? uPlot.join(columns, columns.map(c => c.map(() => 1))) : columns[0];
    const data = [joined[0]];
    groups.flatMap(({of}) => of).forEach((k, place) => { data[k + 1] = joined[place + 1]; });
    return data;
  }

  // What the address keeps after its #: a value by name; null takes it away.
  function keep(values) {
    const state = new URLSearchParams(location.hash.slice(1));
    for (const [name, value] of Object.entries(values)) {
      if (value === null) state.delete(name); else state.set(name, value);
    }
    history.replaceState(null, "", `#${state}`);
  }
  const kept = name => new URLSearchParams(location.hash.slice(1)).get(name);

  const cursor = u => u.cursor.left >= 0 ? u.posToVal(u.cursor.left, "x") : null;

  // The value of a curve at a place, between its points beside it; null in a gap and outside.
  function between(u, number, at) {
    const x = u.data[0], y = u.data[number];
    if (at === null) return null;
    let right = 0, high = x.length;
    while (right < high) {
      const middle = (right + high) >> 1;
      if (x[middle] < at) right = middle + 1; else high = middle;
    }
    let left = right - 1;
    while (left >= 0 && y[left] === undefined) left--;
    while (right < x.length && y[right] === undefined) right++;
    if (right < x.length && x[right] === at) return y[right];
    if (left < 0 || right >= x.length || y[left] === null || y[right] === null) return null;
    return y[left] + (y[right] - y[left]) * (at - x[left]) / (x[right] - x[left]);
  }

  // Curves, edges of bands, and the names of lines across, which have no values.
  function series(chart, arrays) {
    const edges = chart.bands.flatMap(
      band => [{...band, y: band.high, band}, {...band, y: band.low, band, lower: true}]);
    const all = [...edges, ...chart.curves], data = table(all, arrays);
    const options = all.map((curve, k) => ({
      label: curve.name || chart.title || chart.y.label || "value", width: curve.width || 0,
      stroke: curve.band ? (curve.band.share ? () => css(curve.color) : "transparent") : () => css(curve.color),
      dash: curve.dash && curve.dash.length ? curve.dash : undefined,
      paths: curve.dots && !curve.width ? () => null : curve.turns ? piecewise : undefined,
      class: curve.lower || !curve.name && all.length > 1 ? "hidden" : curve.band && !curve.band.share ? "band" : undefined,
      of: curve, named: (curve.name || chart.title || chart.y.label || "value") + (curve.band ? curve.lower ? ": low" : ": high" : ""),
      points: {show: Boolean(curve.dots), size: curve.dots || 0, fill: () => css(curve.color)},
      value: (u, v, number) => {
        if (curve.lower) return ""; // the upper edge says both
        if (!curve.band) return reading(curve.width ? between(u, number, cursor(u)) : v, chart.y.unit);
        const [high, low] = [number, number + 1].map(edge => between(u, edge, cursor(u)));
        if (high === null || low === null) return "–";
        if (curve.band.share) return reading(high - low, chart.y.unit);
        return `${reading(low, "")} … ${reading(high, chart.y.unit)}`;
      },
    }));
    const named = chart.rules.filter(rule => rule.name);
    for (const rule of named) {
      rule.series = data.length;
      data.push(data[0].map(() => undefined));
      options.push({of: rule, label: rule.name, stroke: () => css(rule.color), width: rule.width, dash: rule.dash,
                    paths: () => null, points: {show: false}, value: () => reading(rule.at, rule.upright ? chart.x.unit : chart.y.unit)});
    }
    const bands = chart.bands.map((band, k) => (
      {series: [2 * k + 1, 2 * k + 2], fill: () => band.share ? css(band.color) : faded(css(band.color))}));
    return {data, options, bands};
  }

  // A line through all points between its gaps; the library's own would close a gap within a pixel.
  function piecewise(u, number, first, last) {
    const stroke = new Path2D(), [x, y] = [u.data[0], u.data[number]];
    for (let k = first, open = false; k <= last; k++) {
      if (y[k] === null) open = false;
      else if (y[k] !== undefined) {
        stroke[open ? "lineTo" : "moveTo"](u.valToPos(x[k], "x", true), u.valToPos(y[k], "y", true));
        open = true;
      }
    }
    return {stroke};
  }

  const faded = color => color.replace(/^rgb\((.*)\)$/, "rgba($1,0.25)").replace(/^#(.{6})$/, "#$140");

  // Lines across, marks of limits and remarks.
  function across(u, chart) {
    const {ctx, bbox} = u, ratio = devicePixelRatio;
    const x = v => u.valToPos(v, "x", true), y = v => u.valToPos(v, "y", true);
    ctx.save();
    ctx.font = FONT.replace("12px", `${12 * ratio}px`);
    ctx.textAlign = "left";
    ctx.textBaseline = "alphabetic";
    const zero = y(0);
    if (!chart.y.log && zero > bbox.top && zero < bbox.top + bbox.height - 1) {
      ctx.fillStyle = css("--soft");
      ctx.fillRect(bbox.left, Math.round(zero), bbox.width, ratio);
    }
    for (const rule of chart.rules) {
      if (rule.series && !u.series[rule.series].show) continue;
      const way = rule.upright ? x : y;
      ctx.save();
      ctx.beginPath();
      ctx.rect(bbox.left, bbox.top, bbox.width, bbox.height);
      ctx.clip();
      if (rule.band.length) {
        const [a, b] = rule.band.map(way);
        ctx.fillStyle = faded(css(rule.color));
        if (rule.upright) ctx.fillRect(Math.min(a, b), bbox.top, Math.abs(b - a), bbox.height);
        else ctx.fillRect(bbox.left, Math.min(a, b), bbox.width, Math.abs(b - a));
      }
      ctx.strokeStyle = ctx.fillStyle = css(rule.color);
      ctx.lineWidth = rule.width * ratio;
      ctx.setLineDash(rule.dash.map(n => n * ratio));
      ctx.beginPath();
      const at = way(rule.at);
      if (typeof rule.until === "number") {
        const a = x(rule.until), size = 4 * ratio; // a limit at one time
        ctx.moveTo(a, at); ctx.lineTo(a - size, at - 1.8 * size); ctx.lineTo(a + size, at - 1.8 * size); ctx.fill();
      } else if (rule.upright) { ctx.moveTo(at, bbox.top); ctx.lineTo(at, bbox.top + bbox.height); ctx.stroke(); }
      else { ctx.moveTo(bbox.left, at); ctx.lineTo(bbox.left + bbox.width, at); ctx.stroke(); }
      ctx.restore();
      if (!rule.text || rule.upright) continue;
      ctx.fillStyle = css("--soft");
      ctx.fillText(rule.text, bbox.left + bbox.width - ctx.measureText(rule.text).width - 4 * ratio, at - 3 * ratio);
    }
    ctx.fillStyle = css("--soft");
    const name = [chart.x.label, chart.x.unit && `[${chart.x.unit}]`].join(" ").trim();
    ctx.fillText(name, bbox.left + bbox.width - ctx.measureText(name).width, bbox.top + bbox.height + 36 * ratio);
    ctx.fillText(resolution(chart), bbox.left, bbox.top + bbox.height + 36 * ratio);
    for (const word of chart.words) {
      ctx.fillStyle = css(word.soft ? "--soft" : "--ink");
      const long = ctx.measureText(word.text).width, a = x(word.x), b = y(word.y);
      if (a < bbox.left || a > bbox.left + bbox.width || b < bbox.top || b > bbox.top + bbox.height) continue;
      ctx.fillText(word.text, word.left ? a - long - 7 * ratio : a + 7 * ratio, b + (word.below ? 15 : -6) * ratio);
    }
    ctx.restore();
  }

  const events = chart => chart.rules.filter(rule => rule.upright && rule.text).sort((a, b) => a.at - b.at);

  // Where the words of upright lines stand above a chart, from its left edge, px; words that meet others are left out.
  function above(u, chart) {
    const wide = u.over.clientWidth;
    let free = -Infinity;
    return events(chart).flatMap(event => {
      const at = u.valToPos(event.at, "x"), long = 0.92 * LETTER * event.text.length;
      const left = Math.max(Math.min(at - long / 2, wide - long), 4);
      if (at < -1 || at > wide + 1 || left <= free) return [];
      free = left + long + LETTER;
      return [{event, left}];
    });
  }

  // A button for each mark above a chart shows the part from it to the next.
  function label(u, chart) {
    const spots = above(u, chart), now = spots.map(({event, left}) => `${event.text} ${Math.round(left)}`).join("|");
    if (now === chart.labels) return;
    chart.labels = now;
    u.over.parentNode.querySelectorAll(".event").forEach(button => button.remove());
    for (const {event, left} of spots) {
      const button = document.createElement("button");
      button.className = "event";
      button.tabIndex = -1; // the keys N and P of the chart reach it
      button.textContent = event.text;
      button.style.left = `${u.over.offsetLeft + left}px`;
      button.style.top = `${u.over.offsetTop - 17}px`;
      button.addEventListener("click", () => visit(chart, event));
      u.over.parentNode.append(button);
    }
  }

  function visit(chart, event) {
    const next = events(chart).find(other => other.at > event.at);
    show(chart, ...(event.band.length ? event.band : [event.at, next ? next.at : chart.x.ends[1]]));
  }

  function axis(chart, side) {
    const upright = side === 3, {log} = upright ? chart.y : chart.x;
    const ticks = upright && log !== chart.wasLog ? [] : (upright ? chart.y : chart.x).ticks;
    return {
      side, font: FONT, stroke: () => css("--soft"), incrs: log ? undefined : STEPS, space: upright ? 34 : 75,
      grid: {stroke: () => css("--hair"), width: 1}, ticks: {show: false}, gap: 6,
      border: {show: true, stroke: () => css("--soft"), width: 1},
      values: (u, at, place, space, step) => at.map(v => log ? power(v) : tick(v, step)),
      ...(upright
        ? {size: (u, texts) => Math.max(40, chart.left, 14 + LETTER * Math.max(0, ...(texts || []).map(t => t.length)))}
        : {size: 42}),
      ...(ticks.length ? {splits: () => ticks} : {}),
      ...(log ? {splits: (u, place, low, high) => decades(low, high), filter: (u, at) => at} : {}),
    };
  }

  function heading(chart) {
    const body = document.createElement("div"), unit = chart.y.unit ? ` [${chart.y.unit}]` : "";
    for (const [kind, text] of chart.title && !chart.y.label
      ? [["strong", chart.title + unit]]
      : [["strong", chart.title], ["span", (chart.y.label + unit).trim()]]) {
      if (!text) continue;
      const line = document.createElement(kind);
      line.textContent = text;
      body.append(line);
    }
    return body;
  }

  // A copy of the page's chart with a key, for a part of the page that changes its curves; null if there is none.
  function copy(key, change) {
    const original = [...document.querySelectorAll("figure.live")].find(one => JSON.parse(one.dataset.chart).key === key);
    if (!original) return null;
    const figure = original.cloneNode(true), chart = JSON.parse(original.dataset.chart);
    figure.querySelector(".curves")?.remove();
    figure.classList.remove("drawn");
    for (const name of ["style", "tabindex", "data-begun"]) figure.removeAttribute(name);
    change(chart);
    figure.dataset.chart = JSON.stringify(chart);
    return figure;
  }

  // The ends of a chart's horizontal axis that are to be seen.
  const ends = chart => chart.timed && part ? part.map(t => t / chart.x.size) : chart.own || chart.x.ends;

  function show(chart, low, high) {
    if (chart.timed) part = low === null ? null : [low * chart.x.size, high * chart.x.size];
    else chart.own = low === null ? null : [low, high];
    refresh();
  }

  // Draws the charts in sight that show another part than they should, at the next frame.
  function refresh() {
    if (due) return;
    due = true;
    requestAnimationFrame(() => {
      due = false;
      for (const chart of drawn) {
        const [min, max] = ends(chart), {x} = chart.plot.scales;
        if (chart.seen && (x.min !== min || x.max !== max)) chart.plot.setScale("x", {min, max});
      }
    });
  }

  // What a zoomed chart shows of the curves; "" for the whole chart.
  function resolution(chart) {
    if (ends(chart) === chart.x.ends) return "";
    const {step, dots} = chart.kept;
    return [step ? `least and greatest of each ${reading(Number(step.toPrecision(2)), "s")}` : "every value",
            ...(dots > 1 ? [`one dot of ${dots}`] : [])].join("; ");
  }

  // Puts the cursor of all charts over time, and the mark on each map, at an instant, s; null for nowhere.
  function point(t, source) {
    for (const chart of drawn) {
      if (chart === source || !chart.timed || !chart.seen) continue;
      const left = t === null ? -10 : chart.plot.valToPos(t / chart.x.size, "x");
      chart.plot.setCursor({left: left <= chart.plot.over.clientWidth ? left : -10, top: 10}, false, false);
      chart.plot.setLegend({idxs: chart.plot.cursor.idxs}, false);
    }
    shared.spots.forEach(call => call(t));
  }

  // Takes a drawn chart away, and draws another in its place: as the page has it, or with other curves and their arrays.
  async function replace(figure, chart) {
    figure.chart = chart;
    const old = drawn.find(other => other.figure === figure);
    if (!old) return; // it is drawn when it comes into sight
    old.sized.disconnect();
    old.plot.destroy();
    figure.querySelector(".curves").remove();
    figure.classList.remove("drawn");
    drawn.splice(drawn.indexOf(old), 1);
    await draw(figure);
    refresh();
  }

  async function draw(figure) {
    const still = figure.querySelector("svg"), chart = figure.chart ?? JSON.parse(figure.dataset.chart);
    const {width, height} = still.getBoundingClientRect();
    const wasLog = chart.wasLog = chart.y.log, asked = (kept("log") ?? "").split(" ").includes(chart.key);
    const {data, options, bands} = series(chart, chart.arrays ?? await unpack(chart));
    if (figure.chart && figure.chart !== chart) return draw(figure); // it has become another meanwhile
    const values = data.slice(1).flat();
    chart.logs = wasLog || !chart.bands.some(band => band.share) && values.some(v => v > 0) && !values.some(v => v < 0);
    chart.y.log = wasLog !== (asked && chart.logs);
    const place = document.createElement("div"), head = heading(chart);
    place.className = "curves";
    place.append(head);
    figure.append(place);
    figure.style.width = `${still.getAttribute("width")}px`;
    figure.classList.add("drawn"); // the chart measures itself where it is seen
    const vertical = (u, low, high) => {
      const other = chart.y.log !== wasLog, all = ends(chart) === chart.x.ends;
      if (!other && (all || chart.y.ticks.length)) return chart.y.ends;
      const sides = options.flatMap((curve, k) => curve.width && u.series[k + 1].show // lines of few points go on
        ? ends(chart).map(at => between(u, k + 1, at)) : []).filter(v => chart.y.log ? v > 0 : v !== null && v !== undefined);
      [low, high] = [Math.min(...sides, low ?? Infinity), Math.max(...sides, high ?? -Infinity)];
      if (low > high) return other ? [0.1, 1] : chart.y.ends;
      if (chart.y.log) return uPlot.rangeLog(Math.max(low, 1e-6 * high), high, 10, false);
      return uPlot.rangeNum(other && all ? 0 : low, high, 0.08, true);
    };
    const plot = new uPlot({
      width, height, bands, padding: [chart.rules.some(rule => rule.upright && rule.text) ? 16 : 8, RIGHT, 0, 0],
      scales: {x: {time: false, distr: chart.x.log ? 3 : 1, range: () => ends(chart)},
               y: {distr: chart.y.log ? 3 : 1, range: vertical}},
      axes: [axis(chart, 2), axis(chart, 3)],
      legend: {markers: {dash: (u, k) => u.series[k].dash ? "dashed" : "solid",
                         fill: (u, k) => u.series[k].class === "band" ? faded(css(u.series[k].of.color)) : null}},
      series: [{label: chart.x.label || "at", value: u => reading(cursor(u), chart.x.unit)}, ...options],
      cursor: {
        drag: {x: true, y: false, setScale: false}, y: false, points: {show: false},
        bind: {dblclick: () => () => { show(chart, null, null); }},
      },
      hooks: {
        ready: [u => {
          for (const part of [head, u.root.querySelector(".u-legend")]) part.style.marginLeft = u.over.style.left;
        }],
        draw: [u => { across(u, chart); label(u, chart); }],
        setCursor: [u => {
          u.setLegend({idxs: u.cursor.idxs}, false);
          if (chart.timed) point(cursor(u) === null ? null : cursor(u) * chart.x.size, chart);
        }],
        setSelect: [u => {
          const {left, width: wide} = u.select;
          if (wide > 4) show(chart, u.posToVal(left, "x"), u.posToVal(left + wide, "x"));
          u.setSelect({left: 0, top: 0, width: 0, height: 0}, false);
        }],
        setSeries: [(u, number, {show: seen}) => {
          const upper = number && number <= 2 * bands.length && number % 2;
          if (upper && seen !== undefined) u.setSeries(number + 1, {show: seen});
        }],
      },
    }, data, place);
    const room = () => Math.max(LEAST, height - head.offsetHeight);
    const sized = new ResizeObserver(() => {
      const wide = figure.clientWidth;
      if (wide > 0 && Math.abs(wide - plot.width) > 1) plot.setSize({width: wide, height: room()});
    });
    Object.assign(chart, {plot, figure, options, seen: Boolean(figure.seen), sized});
    plot.setSize({width, height: room()});
    sized.observe(figure);
    drawn.push(chart);
    shared.draws.forEach(call => call(chart));
  }

  function begin() {
    const near = new IntersectionObserver(found => {
      for (const {target, isIntersecting} of found) {
        if (!isIntersecting) continue;
        near.unobserve(target);
        draw(target).then(() => seen.observe(target), error => { // the still picture stays
          target.classList.remove("drawn");
          target.querySelector(".curves")?.remove();
          console.error(error);
        });
      }
    }, {rootMargin: "300px"});
    const seen = new IntersectionObserver(found => {
      for (const {target, isIntersecting} of found) {
        const chart = drawn.find(({figure}) => figure === target);
        if (chart) chart.seen = isIntersecting;
        target.seen = isIntersecting; // also while another chart is drawn in its place
      }
      refresh();
    });
    shared.add = figure => near.observe(figure);
    shared.drop = figure => { // before a page that draws other charts removes one
      near.unobserve(figure);
      seen.unobserve(figure);
      const k = drawn.findIndex(chart => chart.figure === figure);
      if (k >= 0) drawn.splice(k, 1)[0].plot.destroy();
    };
    document.querySelectorAll("figure.live").forEach(shared.add);
    for (const place of document.querySelectorAll("[data-live]")) {
      shared.parts[place.className](place).catch(console.error); // the sentence in its place stays
    }
    for (const hint of document.querySelectorAll(".hint")) hint.hidden = false;
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => {
      for (const {plot} of drawn) plot.redraw(false);
    });
  }
  document.addEventListener("DOMContentLoaded", begin);
  function add(parent, name, text = "", more = {}) { // also to a drawing
    const {namespaceURI} = name === "svg" ? document.querySelector("svg") : parent;
    const part = parent.appendChild(document.createElementNS(namespaceURI, name));
    part.textContent = text;
    for (const [key, value] of Object.entries(more)) part.setAttribute(key, value);
    return part;
  }

  return Object.assign(shared, {add, css, ends, show, point, visit, events, above, copy, cursor, between, resolution,
                                unpack, inflate, keep, kept, replace});
})();
