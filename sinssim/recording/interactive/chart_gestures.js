// What one can do with a chart beside dragging: the wheel, fingers and keys, and the part shown as CSV, PNG and SVG.
"use strict";
(() => {
  const {css, ends, show, point, visit, events, above, resolution, keep, kept, replace} = live;
  const LEAST = 1e-5; // smallest part of the whole that is shown

  // Ends of the horizontal axis on a scale on which equal parts are equally wide, and the way back.
  const scale = chart => chart.x.log ? [Math.log, Math.exp] : [v => v, v => v];

  // Shows a part that is `factor` as wide, with the point at a fraction of the width where it is.
  function zoom(chart, factor, fraction = 0.5) {
    const [to, from] = scale(chart), [low, high] = ends(chart).map(to), [first, last] = chart.x.ends.map(to);
    const wide = Math.max((high - low) * factor, LEAST * (last - first));
    const left = low + fraction * (high - low - wide);
    if (wide >= last - first) show(chart, null, null);
    else clamp(chart, left, wide, from, first, last);
  }

  function pan(chart, share) {
    const [to, from] = scale(chart), [low, high] = ends(chart).map(to), [first, last] = chart.x.ends.map(to);
    if (high - low < last - first) clamp(chart, low + share * (high - low), high - low, from, first, last);
  }

  function clamp(chart, left, wide, from, first, last) {
    const low = Math.min(Math.max(left, first), last - wide);
    show(chart, from(low), from(low + wide));
  }

  // Moves the cursor by a fraction of the width, and says the values there.
  function step(chart, share) {
    const u = chart.plot, wide = u.over.clientWidth, now = u.cursor.left >= 0 ? u.cursor.left : wide / 2;
    aim(chart, Math.min(Math.max(now + share * wide, 0), wide));
    chart.said.textContent = [...chart.figure.querySelectorAll(".u-series:not(.hidden)")].map(
      row => `${row.querySelector(".u-label").textContent} ${row.querySelector(".u-value").textContent}`).join(", ");
  }

  const aim = (chart, left) => chart.plot.setCursor({left, top: 10});

  function jump(chart, way) {
    const marks = events(chart), [low] = ends(chart), hair = 1e-9 * (chart.x.ends[1] - chart.x.ends[0]);
    const next = way > 0 ? marks.find(mark => mark.at > low + hair) : marks.findLast(mark => mark.at < low - hair);
    if (next) visit(chart, next);
  }

  const KEYS = {
    ArrowLeft: (chart, far) => step(chart, far ? -0.1 : -0.01), ArrowRight: (chart, far) => step(chart, far ? 0.1 : 0.01),
    Home: chart => step(chart, -1), End: chart => step(chart, 1),
    PageUp: chart => pan(chart, -0.5), PageDown: chart => pan(chart, 0.5),
    "+": chart => zoom(chart, 0.5, place(chart)), "=": chart => zoom(chart, 0.5, place(chart)),
    "-": chart => zoom(chart, 2, place(chart)), Escape: chart => show(chart, null, null),
    n: chart => jump(chart, 1), p: chart => jump(chart, -1),
  };
  const place = ({plot}) => plot.cursor.left >= 0 ? plot.cursor.left / plot.over.clientWidth : 0.5;

  function keys(chart) {
    const {figure} = chart;
    if (!figure.hasAttribute("tabindex")) figure.addEventListener("keydown", event => {
      if (event.target !== figure || event.ctrlKey || event.altKey || event.metaKey || !KEYS[event.key]) return;
      event.preventDefault();
      KEYS[event.key](live.drawn.find(other => other.figure === figure), event.shiftKey);
    });
    figure.tabIndex = 0;
    figure.setAttribute("role", "group");
    figure.setAttribute("aria-label", `${chart.title || chart.y.label}: arrow keys move the cursor, plus and minus zoom, `
      + "page keys move the part shown, N and P go to the next and the former mark, Escape shows all");
    for (const name of figure.querySelectorAll(".u-series:not(:first-child) th")) {
      name.tabIndex = 0;
      name.setAttribute("role", "button");
      name.setAttribute("aria-label", name.querySelector(".u-label").textContent); // also where it is not shown
      name.setAttribute("aria-pressed", "true");
      name.addEventListener("keydown", event => {
        if (event.key !== "Enter" && event.key !== " ") return;
        event.preventDefault();
        name.click();
      });
      name.addEventListener("click", () => name.setAttribute("aria-pressed", !name.parentNode.classList.contains("u-off")));
    }
  }

  // The wheel zooms a chart that was clicked on, and any with Ctrl, as a touchpad's pinch does; sideways, it moves.
  function wheel(chart) {
    const {over} = chart.plot;
    over.addEventListener("mousedown", () => chart.figure.focus({preventScroll: true}));
    over.addEventListener("wheel", event => {
      if (!event.ctrlKey && document.activeElement !== chart.figure) return;
      event.preventDefault();
      const sideways = event.shiftKey ? event.deltaX || event.deltaY : event.deltaX;
      if (Math.abs(sideways) >= Math.abs(event.deltaY) || event.shiftKey) pan(chart, sideways / 800);
      else zoom(chart, Math.exp(event.deltaY / 400), event.offsetX / over.clientWidth);
    }, {passive: false});
  }

  // One finger moves the cursor, two zoom and move the part that is shown.
  function fingers(chart) {
    const {over} = chart.plot;
    let before = null;
    const where = touches => {
      const left = over.getBoundingClientRect().left, at = [...touches].map(touch => touch.clientX - left);
      return at.length > 1 ? {middle: (at[0] + at[1]) / 2, apart: Math.max(Math.abs(at[0] - at[1]), 20)} : {middle: at[0]};
    };
    over.addEventListener("touchstart", event => { before = where(event.touches); });
    over.addEventListener("touchmove", event => {
      const now = where(event.touches), wide = over.clientWidth;
      if (!now.apart) aim(chart, Math.min(Math.max(now.middle, 0), wide));
      else if (before?.apart) {
        zoom(chart, before.apart / now.apart, before.middle / wide);
        pan(chart, (before.middle - now.middle) / wide);
      }
      if (now.apart) event.preventDefault();
      before = now;
    }, {passive: false});
  }

  // The shortest number that is the same 4-byte float.
  function shortest(value) {
    for (let digits = 1; digits < 9; digits++) {
      const text = Number(value.toPrecision(digits));
      if (Math.fround(text) === Math.fround(value)) return String(text);
    }
    return String(Number(value.toPrecision(9)));
  }

  const cell = text => /[",\r\n]/.test(text) ? `"${text.replace(/"/g, '""')}"` : text;
  const headed = (name, unit) => cell(unit ? `${name} [${unit}]` : name);

  // The shown part of the shown curves: a column for each, empty where it has no value at that place.
  function csv(chart) {
    const {data, series} = chart.plot, [low, high] = ends(chart);
    const shown = chart.options.map((curve, k) => ({...curve, k: k + 1})).filter(({k, named}) => series[k].show && named);
    const lines = [[headed(chart.x.label || "time", chart.x.unit), ...shown.map(curve => headed(curve.named, chart.y.unit))]];
    data[0].forEach((at, row) => {
      const values = shown.map(({k}) => data[k][row] ?? null);
      if (at >= low && at <= high && values.some(value => value !== null)) {
        lines.push([at, ...values].map(value => value === null ? "" : shortest(value)));
      }
    });
    return lines.map(line => line.join(",")).join("\n") + "\n";
  }

  async function copy(text) {
    try {
      await navigator.clipboard.writeText(text);
    } catch { // an old browser, or one that asks for leave
      const before = document.activeElement, field = document.body.appendChild(document.createElement("textarea"));
      field.value = text;
      field.select();
      document.execCommand("copy");
      field.remove();
      before.focus();
    }
  }

  // A chart as an SVG element: its title, axes, what is shown, and its legend.
  function drawing(chart) {
    const u = chart.plot, heads = [...chart.figure.querySelectorAll(".curves > div > :is(strong, span)")];
    const left = u.over.offsetLeft, wide = u.over.clientWidth, high = u.over.clientHeight;
    const top = 22 + 17 * heads.length, bottom = top + high;
    const x = v => left + u.valToPos(v, "x"), y = v => top + u.valToPos(v, "y");
    const svg = document.createElementNS(chart.figure.querySelector("svg").namespaceURI, "svg");
    const add = (name, attributes, text = "", to = svg) => {
      const part = document.createElementNS(svg.namespaceURI, name);
      for (const [key, value] of Object.entries(attributes)) part.setAttribute(key, value);
      part.textContent = text;
      return to.appendChild(part);
    };
    const write = (at, height, text, color, more = {}) => add("text", {x: at, y: height, fill: css(color), ...more}, text);
    const inside = {"clip-path": "url(#inside)"};
    add("rect", {width: "100%", height: "100%", fill: css("--paper")});
    add("rect", {x: left, y: top, width: wide, height: high}, "", add("clipPath", {id: "inside"}));
    heads.forEach((line, k) => write(left, 15 + 17 * k, line.textContent, k ? "--soft" : "--ink", k ? {} : {"font-weight": 600}));
    [[0, v => [x(v), top, x(v), bottom]], [1, v => [left, y(v), left + wide, y(v)]]].forEach(([axis, ends]) => {
      const {_splits: at, _values: texts} = u.axes[axis];
      (at || []).forEach((v, k) => {
        const [x1, y1, x2, y2] = ends(v);
        if (v === null || texts[k] === null || x1 < left - 1 || x1 > left + wide + 1 || y1 < top - 1 || y1 > bottom + 1) return;
        add("line", {x1, y1, x2, y2, stroke: css("--hair")});
        if (axis) write(left - 6, y1 + 4, texts[k], "--soft", {"text-anchor": "end"});
        else write(x1, bottom + 16, texts[k], "--soft", {"text-anchor": "middle"});
      });
    });
    add("path", {d: `M${left} ${top}V${bottom}H${left + wide}`, fill: "none", stroke: css("--soft")});
    write(left + wide, bottom + 34, chart.x.unit ? `${chart.x.label} [${chart.x.unit}]` : chart.x.label, "--soft", {"text-anchor": "end"});
    write(left, bottom + 34, resolution(chart), "--soft");
    marks(chart, {x, y, left, wide, top, bottom, add, inside});
    for (const {event, left: from} of above(u, chart)) write(left + from, top - 4, event.text, "--soft", {"font-size": 11});
    const below = legend(chart, left, bottom + 52, left + wide, add, write);
    for (const [key, value] of Object.entries({width: u.width, height: below, viewBox: `0 0 ${u.width} ${below}`,
      "font-family": '"Liberation Sans", Arial, sans-serif', "font-size": 12})) svg.setAttribute(key, value);
    return svg;
  }

  function marks(chart, {x, y, left, wide, top, bottom, add, inside}) {
    const u = chart.plot, [at] = u.data, [low, high] = ends(chart);
    const first = Math.max(0, at.findIndex(v => v >= low) - 1);
    let last = at.findIndex(v => v > high);
    last = last < 0 ? at.length : last + 1;
    const points = k => {
      const runs = [[]];
      for (let row = first; row < last; row++) {
        const value = u.data[k][row];
        if (value === null) runs.push([]);
        else if (value !== undefined) runs.at(-1).push(`${x(at[row]).toFixed(2)} ${y(value).toFixed(2)}`);
      }
      return runs.filter(run => run.length);
    };
    chart.bands.forEach((band, k) => {
      if (!u.series[2 * k + 1].show) return;
      const [upper, lower] = [points(2 * k + 1), points(2 * k + 2)];
      upper.forEach((run, n) => lower[n] && add("polygon", {points: [...run, ...lower[n].reverse()].join(" "),
        fill: css(band.color), "fill-opacity": band.share ? 1 : 0.25, ...inside}));
    });
    chart.curves.forEach((curve, n) => {
      const k = 2 * chart.bands.length + n + 1, stroke = css(curve.color);
      if (!u.series[k].show) return;
      for (const run of points(k)) {
        if (curve.width) add("polyline", {points: run.join(" "), fill: "none", stroke, "stroke-width": curve.width,
                                          "stroke-dasharray": curve.dash.join(" "), ...inside});
        if (curve.dots) for (const dot of run) {
          const [cx, cy] = dot.split(" ");
          add("circle", {cx, cy, r: curve.dots / 2, fill: stroke, ...inside});
        }
      }
    });
    for (const rule of chart.rules) {
      if (rule.series && !u.series[rule.series].show || typeof rule.until === "number") continue;
      const line = rule.upright ? {x1: x(rule.at), y1: top, x2: x(rule.at), y2: bottom}
        : {x1: left, y1: y(rule.at), x2: left + wide, y2: y(rule.at)};
      add("line", {...line, stroke: css(rule.color), "stroke-width": rule.width, "stroke-dasharray": rule.dash.join(" "), ...inside});
    }
  }

  // Writes the names of the shown curves in rows and returns where they end.
  function legend(chart, left, top, right, add, write) {
    let at = left;
    chart.options.forEach((curve, k) => {
      if (!chart.plot.series[k + 1].show || curve.class === "hidden") return;
      const long = 34 + 6.6 * curve.label.length;
      if (at > left && at + long > right) { at = left; top += 16; }
      add("line", {x1: at, y1: top - 4, x2: at + 20, y2: top - 4, stroke: css(curve.of.color), "stroke-width": 2,
                   "stroke-dasharray": (curve.dash || []).join(" ")});
      write(at + 25, top, curve.label, "--soft");
      at += long + 8;
    });
    return top + 10;
  }

  const picture = chart => new XMLSerializer().serializeToString(drawing(chart));

  async function png(chart) {
    const image = new Image(), canvas = document.createElement("canvas"), text = picture(chart);
    image.src = `data:image/svg+xml;charset=utf-8,${encodeURIComponent(text)}`;
    await image.decode();
    [canvas.width, canvas.height] = [2 * image.width, 2 * image.height];
    canvas.getContext("2d").drawImage(image, 0, 0, canvas.width, canvas.height);
    return new Promise(done => canvas.toBlob(done, "image/png"));
  }

  const fileName = chart => (chart.title || chart.y.label || "chart").replace(/[^\p{L}\p{N}]+/gu, "-").replace(/^-|-$/g, "");

  function save(blob, name) {
    const link = document.createElement("a");
    link.href = URL.createObjectURL(blob);
    link.download = name;
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 60000);
  }

  const TOOLS = [
    ["CSV", "Copy the shown part as CSV", async chart => { await copy(csv(chart)); return "copied"; }],
    ["PNG", "Save what is shown as PNG", async chart => save(await png(chart), `${fileName(chart)}.png`)],
    ["SVG", "Save what is shown as SVG", async chart => save(new Blob([picture(chart)], {type: "image/svg+xml"}), `${fileName(chart)}.svg`)],
  ];

  // Changes the vertical scale between linear and logarithmic; the address keeps the charts that have the other one.
  function logSwitch(chart) {
    const button = document.createElement("button"), {figure, y} = chart;
    Object.assign(button, {type: "button", textContent: "log", title: "Logarithmic scale", className: "log"});
    button.setAttribute("aria-pressed", y.log);
    button.addEventListener("click", async () => {
      const others = (kept("log") ?? "").split(" ").filter(key => key && key !== chart.key);
      keep({log: [...others, ...(y.log === chart.wasLog ? [chart.key] : [])].join(" ") || null});
      const page = figure.chart ?? JSON.parse(figure.dataset.chart);
      await replace(figure, {...page, y: {...page.y, log: chart.wasLog}});
      figure.querySelector(".log").focus();
    });
    return button;
  }

  function tools(chart) {
    const row = document.createElement("div");
    row.className = "tools";
    for (const [name, title, act] of TOOLS) {
      const button = document.createElement("button");
      Object.assign(button, {type: "button", textContent: name, title});
      button.addEventListener("click", async () => {
        button.textContent = await act(chart) || name;
        setTimeout(() => { button.textContent = name; }, 1500);
      });
      row.append(button);
    }
    if (chart.logs) row.append(logSwitch(chart));
    chart.said = document.createElement("div");
    chart.said.className = "said";
    chart.said.setAttribute("aria-live", "polite");
    chart.figure.querySelector(".curves").append(row, chart.said);
  }

  live.draws.push(tools, keys, wheel, fingers);
  Object.assign(live, {zoom, pan, csv, picture, png, save, copyText: copy});
})();
