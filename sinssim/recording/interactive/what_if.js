// What if a source of errors were larger or smaller: sliders beside the sources of a covariance budget, from whose
// covariances by source the circles, shares, ranking, table and verdicts follow here as the program computes them.
"use strict";
(() => {
  const LEAST = -2, MOST = 2; // powers of ten between which the sliders change a source
  const DECADES = 20; // powers of two beyond which a source counts as without effect on a requirement
  const COLUMNS = ["north", "east", "down", "v north", "v east", "v down", "tilt n", "tilt e", "heading"];
  const SIZES = [1, 1, 1, 1, 1, 1, Math.PI / 10800, Math.PI / 10800, Math.PI / 10800];

  const {add} = live, {radius, inside, root} = live.circles;

  // ---- a budget with other sizes of its sources ----

  // The arrays of a budget by what they are; see analyses/error_budget/what_if.py.
  function unfold(given, arrays) {
    const [time, ...rest] = arrays, none = time.map(() => 0);
    const own = given.sources.map((source, k) => {
      const [a, b, c, table] = rest.slice(4 * k, 4 * k + 4);
      return source.random ? {nn: a, ne: b, ee: c, n: none, e: none, table} : {nn: none, ne: none, ee: none, n: a, e: b, table};
    });
    let next = 4 * given.sources.length;
    const parts = given.requirements.map(({component}) => {
      if (component < 0) return null;
      next += given.sources.length;
      return rest.slice(next - given.sources.length, next);
    });
    return {...given, time, own, parts};
  }

  // The sum over all sources at a row; `factors` are those of their sizes.
  function sum(budget, factors, row) {
    const at = {nn: 0, ne: 0, ee: 0, n: 0, e: 0};
    budget.own.forEach((own, k) => {
      const f = factors[k];
      for (const part of ["nn", "ne", "ee"]) at[part] += f * f * own[part][row];
      for (const part of ["n", "e"]) at[part] += f * own[part][row];
    });
    return at;
  }

  const square = at => at.nn + at.ee + at.n * at.n + at.e * at.e;

  // The part of a source in the mean square at a row.
  function part(budget, factors, k, row, at) {
    const own = budget.own[k], f = factors[k];
    return f * f * (own.nn[row] + own.ee[row]) + f * (own.n[row] * at.n + own.e[row] * at.e);
  }

  // The quantity of a requirement at its rows.
  function quantities(budget, number, factors) {
    const {share, rate, rows} = budget.requirements[number], parts = budget.parts[number];
    return rows.map((row, n) => {
      if (parts) return component(budget, factors, k => parts[k][n]);
      const r = radius(sum(budget, factors, row), share);
      return rate ? r / budget.time[row] : r;
    });
  }

  // The root mean square of a component, of which a source has a square or a mean.
  function component(budget, factors, value) {
    let [squares, mean] = [0, 0];
    budget.sources.forEach(({random}, k) => {
      if (random) squares += factors[k] ** 2 * value(k); else mean += factors[k] * value(k);
    });
    return Math.sqrt(Math.max(squares, 0) + mean * mean);
  }

  const largest = values => values.reduce((most, value) => value > most || Number.isNaN(most) ? value : most, NaN);

  function ranking(budget, factors, row) {
    const whole = sum(budget, factors, row), now = radius(whole, 0.95), all = square(whole);
    return budget.sources.map((source, k) => {
      const alone = factors.map((f, n) => n === k ? f : 0), halved = factors.map((f, n) => n === k ? f / 2 : f);
      return {k, share: all ? part(budget, factors, k, row, whole) / all : 0,
              alone: radius(sum(budget, alone, row), 0.95), gain: now - radius(sum(budget, halved, row), 0.95)};
    }).sort((a, b) => b.gain - a.gain);
  }

  // The largest factor of a source with which a requirement is met, the others as they are; NaN if there is none.
  function allowed(budget, number, factors, k) {
    const {share, rate, rows, limit} = budget.requirements[number];
    const excess = f => { // positive if the requirement is not met
      const tried = factors.map((own, n) => n === k ? f : own);
      if (budget.parts[number]) return largest(quantities(budget, number, tried)) / limit - 1;
      return largest(rows.map(row => share - inside(limit * (rate ? budget.time[row] : 1), sum(budget, tried, row))));
    };
    const without = excess(0);
    if (without > 0) return NaN;
    let [low, below, high, above] = [0, without, 1, excess(1)];
    for (let power = 0; above <= 0; power++) {
      if (power > DECADES) return Infinity;
      [low, below, high] = [high, above, 2 * high];
      above = excess(high);
    }
    return low + root(f => excess(low + f), high - low, below, above);
  }

  // All that follows from the factors of the sources.
  function answer(budget, factors) {
    const at = budget.time.map((_, row) => sum(budget, factors, row));
    return {
      at, cep: at.map(one => radius(one, 0.5)), r95: at.map(one => radius(one, 0.95)),
      ranked: budget.ranked.map(row => ranking(budget, factors, row)),
      table: budget.rows.map((_, n) => SIZES.map((_, i) => component(budget, factors, k => budget.own[k].table[9 * n + i]))),
      verdicts: budget.requirements.map(({limit}, n) => {
        const value = largest(quantities(budget, n, factors));
        return {value, met: value <= limit};
      }),
    };
  }

  // ---- what is seen ----

  const four = v => {
    if (Number.isNaN(v)) return "–";
    if (v >= 1e4 && v < 1e7) return Math.round(v).toLocaleString("en");
    return String(Number(v.toPrecision(4))).replace("-", "\u2212");
  };
  const twelve = v => Number(v.toPrecision(12));
  const length = m => m >= 1000 ? `${four(m / 1000)} km` : m < 1 ? `${four(100 * m)} cm` : `${four(m)} m`;

  async function begin(place) {
    const given = JSON.parse(place.dataset.live), budget = unfold(given, await live.unpack(given));
    const factors = budget.sources.map(() => 1), base = answer(budget, factors);
    place.textContent = "";
    const view = {place, budget, factors, base, rows: [], charts: {}};
    const says = [
      "Move a slider, write a value or take a grade: everything below follows at once, as `sinssim budget --set` "
        + "computes it. The address keeps the setting.", ...budget.notes];
    for (const text of says) {
      const note = add(place, "p", "", {class: "note"});
      text.split("`").forEach((words, n) => add(note, n % 2 ? "code" : "span", words));
    }
    view.now = add(place, "p", "", {class: "lead", "aria-live": "polite"});
    view.verdicts = add(place, "ul");
    commands(view);
    copyOf(view, "circles");
    sliders(view);
    copyOf(view, "shares");
    view.table = add(add(add(place, "details"), "summary", "Errors over time with these sizes").parentNode, "div", "", {class: "wide"});
    read(view);
    addEventListener("hashchange", () => read(view));
    live.whatIf = {budget, answer, radius, inside, allowed, view, grade: () => gradeText(view), command: () => commandText(view)};
  }

  function commands(view) {
    const row = add(view.place, "p", "", {class: "choices"}), names = Object.keys(view.budget.grades);
    const label = add(row, "label", "All sensors of "), choice = add(label, "select");
    ["this scenario", ...names].forEach(name => add(choice, "option", name));
    choice.addEventListener("change", () => {
      const grade = view.budget.grades[choice.value];
      view.budget.sources.forEach(({name, value, key}, k) => {
        if (!grade) view.factors[k] = 1;
        else if (name in grade.values && value && key.startsWith("imu.")) view.factors[k] = grade.values[name] / value;
      });
      view.said.textContent = grade?.more.length
        ? `${choice.value} also has ${grade.more.join(", ")}, which this budget does not have: --set imu.grade=${choice.value}` : "";
      change(view);
    });
    if (!names.length) label.hidden = true;
    view.choice = choice;
    for (const [name, act] of [
      ["As computed", () => { view.factors.fill(1); choice.selectedIndex = 0; change(view); return ""; }],
      ["Command", () => commandText(view)], ["Save as grade", () => save(view)]]) {
      add(row, "button", name, {type: "button"}).addEventListener("click", () => { view.said.textContent = act(); });
    }
    view.said = add(view.place, "pre", "", {class: "said-here", "aria-live": "polite"});
  }

  function sliders(view) {
    const {budget} = view, limits = budget.requirements.length > 0;
    const table = add(add(view.place, "div", "", {class: "wide"}), "table");
    const heads = add(add(table, "thead"), "tr");
    ["source", "smaller … larger", "value", "", "share", "R95 alone", "R95 decrease if halved", ...(limits ? ["at most"] : [])].forEach(
      (head, n) => add(heads, "th", head, n === 0 || n === 3 ? {class: "name"} : {}));
    view.body = add(table, "tbody");
    budget.sources.forEach((source, k) => {
      const row = add(view.body, "tr"), name = `${source.group}: ${source.label}`;
      add(row, "td", name, {class: "name"});
      const [slide, field] = [add(row, "td"), add(row, "td")], cells = {};
      add(row, "td", source.unit, {class: "name"});
      for (const what of ["share", "alone", "gain", ...(limits ? ["most"] : [])]) cells[what] = add(row, "td");
      view.rows.push({row, cells});
      if (!source.value) return;
      const range = add(slide, "input", "", {type: "range", min: LEAST, max: MOST, step: 0.01, "aria-label": `${name}, power of ten`});
      const value = add(field, "input", "", {type: "number", min: 0, step: "any", "aria-label": `${name} in ${source.unit}`, list: `grades-${k}`});
      const list = add(field, "datalist", "", {id: `grades-${k}`});
      for (const [grade, values] of Object.entries(budget.grades)) {
        if (source.name in values.values) add(list, "option", grade, {value: values.values[source.name]});
      }
      range.addEventListener("input", () => { // three digits are as many as one writes by hand
        const factor = 10 ** Number(range.value);
        view.factors[k] = factor === 1 ? 1 : Number((source.value * factor).toPrecision(3)) / source.value;
        change(view);
      });
      value.addEventListener("change", () => {
        const wanted = Number(value.value);
        if (value.value !== "" && wanted >= 0 && Number.isFinite(wanted)) view.factors[k] = wanted / Math.abs(source.value);
        change(view);
      });
      Object.assign(view.rows[k], {range, value});
    });
  }

  // A copy of one of the page's charts, with the curves as computed beside those that follow the sliders.
  function copyOf(view, key) {
    const figure = live.copy(key, chart => {
      chart.key = `what if ${key}`;
      chart.curves.push(...chart.curves.map(
        curve => ({...curve, name: `${curve.name.split(":")[0]} as computed`, width: 1, dash: [4, 3]})));
      for (const rule of chart.rules) rule.name = rule.name.replace(/: (met|not met)( \(above the plot\))?$/, "");
    });
    if (!figure) return;
    add(view.place, "div", "", {class: "charts"}).append(figure);
    live.add(figure);
  }

  live.draws.push(chart => {
    const view = live.whatIf?.view, key = /^what if (\w+)$/.exec(chart.key)?.[1];
    if (!view || !key) return;
    view.charts[key] = chart;
    redraw(view);
  });

  function redraw(view) {
    const {circles, shares} = view.charts, {cep, r95} = view.result, {own, time, sources} = view.budget;
    if (circles) {
      const data = circles.plot.data.slice(), size = circles.y.size;
      data[1] = r95.map(v => v / size);
      data[2] = cep.map(v => v / size);
      const most = Math.max(largest(r95), largest(view.base.r95)) / size;
      circles.y.ends = [0, 1.05 * Math.max(most, ...circles.rules.map(rule => rule.at).filter(at => at < 1.5 * most))];
      circles.plot.setData(data);
    }
    if (shares) {
      const labels = sources.map(({group, label}) => `${group}: ${label}`), data = shares.plot.data.slice();
      const rows = time.map((_, row) => row).slice(time.length - data[0].length);
      const named = shares.bands.map(({name}) => labels.indexOf(name));
      const parts = rows.map(row => {
        const at = view.result.at[row], all = square(at);
        return own.map((_, k) => all ? part(view.budget, view.factors, k, row, at) / all : 0);
      });
      let below = rows.map(() => 0);
      for (let n = shares.bands.length - 1; n >= 0; n--) { // the lowest band is the last
        const {name} = shares.bands[n], add = parts.map(row => named[n] >= 0 ? row[named[n]]
          : row.reduce((sum, share, k) => sum + (named.includes(k) || sources[k].random === (name !== "all others") ? 0 : share), 0));
        const above = below.map((low, i) => low + 100 * add[i]);
        [data[2 * n + 1], data[2 * n + 2], below] = [above, below, above];
      }
      shares.plot.setData(data);
    }
  }

  // Shows what follows from the factors, and keeps them in the address.
  function change(view, keep = true) {
    const {budget, factors} = view;
    if (keep) {
      live.keep(Object.fromEntries(budget.sources.map(({name, value}, k) => [name, factors[k] === 1 ? null : twelve(value * factors[k])])));
    }
    cancelAnimationFrame(view.due);
    view.due = requestAnimationFrame(() => show(view));
  }

  function show(view) {
    const {budget, factors, base} = view, now = answer(budget, factors), end = budget.time.length - 1;
    view.result = now;
    const then = (name, values, before) => `${name} ${length(values[end])}`
      + (Math.abs(values[end] / before[end] - 1) < 1e-9 ? "" : ` (as computed ${length(before[end])})`);
    view.now.textContent = `At the end: ${then("CEP", now.cep, base.cep)}, ${then("R95", now.r95, base.r95)}.`;
    view.verdicts.textContent = "";
    now.verdicts.forEach(({value, met}, n) => {
      const {text, size, unit} = budget.requirements[n], line = add(view.verdicts, "li");
      add(line, "span", met ? "met" : "not met", {class: met ? "met" : "missed"});
      line.append(`: ${text}, here ${four(value / size)} ${unit}`);
    });
    const focus = document.activeElement;
    now.ranked[0].forEach(({k, share, alone, gain}) => {
      const {row, cells, range, value} = view.rows[k], {unit, value: given} = budget.sources[k];
      cells.share.textContent = `${(100 * share).toFixed(2)} %`;
      cells.alone.textContent = length(alone);
      cells.gain.textContent = length(Math.abs(gain)).replace(/^/, gain < 0 ? "\u2212" : "");
      if (range) {
        if (focus !== range) range.value = Math.log10(Math.max(factors[k], 1e-9));
        range.setAttribute("aria-valuetext", `${twelve(given * factors[k])} ${unit}`);
        if (focus !== value) value.value = twelve(Math.abs(given) * factors[k]);
      }
      if (!view.body.contains(focus)) view.body.append(row); // rows do not leave a slider that is being moved
    });
    tabulate(view);
    redraw(view);
    clearTimeout(view.later);
    view.later = setTimeout(() => limits(view, now), 200);
  }

  // The largest values with which all requirements are met; source by source, because they take a moment.
  async function limits(view, now) {
    const {budget, factors, rows} = view, tested = budget.requirements.map((_, n) => n);
    for (const {k} of tested.length ? now.ranked[0] : []) {
      const {value} = budget.sources[k];
      if (!value) continue;
      const all = tested.map(n => allowed(budget, n, factors, k)), most = Math.min(...all); // NaN if one is
      rows[k].cells.most.textContent = Number.isNaN(most) ? "none" : most > 1000 ? "any" : four(most * Math.abs(value));
      await new Promise(done => setTimeout(done));
      if (view.result !== now) return;
    }
  }

  function tabulate(view) {
    const {budget, result} = view, table = document.createElement("table"), heads = add(add(table, "thead"), "tr");
    ["t [s]", "CEP [m]", "R95 [m]", ...COLUMNS.map((name, i) => `${name} [${i < 3 ? "m" : i < 6 ? "m/s" : "arcmin"}]`)].forEach(
      head => add(heads, "th", head));
    const body = add(table, "tbody");
    budget.rows.forEach((row, n) => {
      const line = add(body, "tr");
      [budget.time[row], result.cep[row], result.r95[row], ...result.table[n].map((v, i) => v / SIZES[i])].forEach(
        v => add(line, "td", four(v)));
    });
    view.table.replaceChildren(table);
  }

  // Takes the sizes that the address has, in the units of the sources.
  function read(view) {
    const state = new URLSearchParams(location.hash.slice(1));
    view.budget.sources.forEach(({name, value}, k) => {
      const wanted = state.has(name) && value ? Number(state.get(name)) / value : 1;
      view.factors[k] = wanted >= 0 && Number.isFinite(wanted) ? wanted : 1;
    });
    change(view, false);
  }

  const changed = ({budget, factors}) => budget.sources.map((source, k) => ({...source, factor: factors[k]})).filter(
    ({factor}) => factor !== 1);

  // The command that computes this setting, from the scenario beside the page.
  function commandText(view) {
    const {requirements, options} = view.budget, all = changed(view), quoted = text => `'${text.replaceAll("'", "'\\''")}'`;
    const sets = all.filter(({key}) => key).map(({key, values, factor}) => {
      const scaled = values.map(value => twelve(value * factor));
      return `--set ${quoted(`${key}=${scaled.length > 1 ? `[${scaled.join(", ")}]` : scaled[0]}`)}`;
    });
    const asked = requirements.map(({text}) => `--require ${quoted(text)}`);
    const left = all.filter(({key}) => !key).map(({name}) => name);
    return ["sinssim budget scenario.toml", ...options, ...sets, ...asked].join(" ")
      + (left.length ? `\n# no single key gives ${left.join(", ")}, which stay as computed` : "");
  }

  // The sensors of this setting as the file of a grade.
  function gradeText(view) {
    const {budget, factors} = view, quoted = text => JSON.stringify(text.replace(/[\u0000-\u001f\u007f]/g, " "));
    const lines = budget.sources.flatMap(({grade, value}, k) => grade && value * factors[k] ? [`${grade} = ${twelve(value * factors[k])}`] : []);
    const others = Object.entries(budget.rest).map(([key, value]) => `${key} = ${value}`);
    return [`description = ${quoted(`sensors of a what-if of the budget of ${budget.title}`)}`,
            `source = ${quoted(`set by hand on the page of the covariance budget of ${budget.title}`)}`, "", ...lines, ...others, ""].join("\n");
  }

  function save(view) {
    live.save(new Blob([gradeText(view)], {type: "text/plain"}), "grade.toml");
    return "Saved: give the file's place as imu.grade.";
  }

  live.parts.what_if = begin;
})();
