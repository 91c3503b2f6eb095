// The page of the workbench. It knows nothing but what the server tells: files of a folder, and commands that run.
"use strict";
document.addEventListener("DOMContentLoaded", () => {
  const $ = id => document.getElementById(id);
  const opened = {path: null, shipped: false, study: false, text: "", digest: ""};
  const ENDINGS = {run: "", ensemble: "-ensemble", budget: "-budget", align: "-alignment", calibrate: "-calibration", compare: ""};
  const lists = {scenarios: [], runs: []};
  let running = new Map(), checking = false, planned = 0;

  async function ask(what, body) {
    const [path, query] = body === undefined ? [what, {}] : [what, {method: "POST", body: JSON.stringify(body),
                                                                     headers: {"Content-Type": "application/json"}}];
    let answer;
    try {
      answer = await fetch(path, query);
    } catch {
      trouble("The workbench does not answer: it has ended. Start it again, and open the address that it prints.");
      throw new Error("no answer");
    }
    const found = await answer.json().catch(() => ({error: `the workbench answered ${answer.status}.`}));
    if (!answer.ok) throw new Error(found.error);
    return found;
  }

  function trouble(text) {
    $("trouble").textContent = text;
    $("trouble").hidden = !text;
  }
  const attempt = work => (...given) => Promise.resolve(work(...given)).then(() => {}, ({message}) => {
    if (message !== "no answer") trouble(message[0].toUpperCase() + message.slice(1));
  });

  // An element with a text, classes and attributes; texts stay texts.
  function element(kind, text = "", about = {}) {
    const made = document.createElement(kind);
    made.textContent = text;
    for (const [name, value] of Object.entries(about)) {
      if (typeof value === "function") made.addEventListener(name, value);
      else if (value !== false) made.setAttribute(name, value);
    }
    return made;
  }

  // The list of scenarios

  function showScenarios() {
    const word = $("find").value.toLowerCase();
    for (const [id, shipped] of [["own", false], ["shipped", true]]) {
      const there = lists.scenarios.filter(one => one.shipped === shipped && one.path.toLowerCase().includes(word));
      $(id).replaceChildren(...there.map(one => {
        const entry = element("li");
        const current = one.path === opened.path ? {"aria-current": "true"} : {};
        entry.append(element("button", one.path, {type: "button", ...current, click: attempt(() => choose(one))}));
        return entry;
      }));
      if (!there.length) $(id).append(element("li", word ? "none of that name" : "none yet: save a shipped one under a name", {class: "note"}));
    }
  }

  async function choose({path, shipped, study = path.endsWith("/study.toml")}) {
    if (dirty() && !confirm(`${opened.path} has changes that are not saved. Leave them?`)) return;
    const found = await ask(`scenario?path=${encodeURIComponent(path)}`);
    trouble("");
    Object.assign(opened, {path, shipped, study, ...found});
    for (const option of $("command").options) option.hidden = option.disabled = (option.value === "compare") !== study;
    if ($("command").selectedOptions[0]?.disabled ?? true) $("command").value = study ? "compare" : "run";
    sheet.text = found.text;
    $("name").textContent = shipped ? `${path} (shipped)` : path;
    $("path").value = shipped ? `${path}.toml` : /^runs\/.*\/(scenario|study)\.toml$/.test(path) ? `${path.split("/").at(-2)}.toml` : path;
    history.replaceState(null, "", `#${encodeURIComponent(path)}`); // what a reload opens again
    $("sheet").hidden = false;
    $("out").value = "";
    $("verdict").textContent = "";
    $("mistakes").replaceChildren();
    showScenarios();
    changed();
  }

  const dirty = () => opened.path !== null && sheet.text !== opened.text;

  // Checks while the text is written: the newest text as soon as the last check has ended

  const sheet = editor.make($("editor"), () => changed());

  function changed() {
    const aside = opened.shipped && !dirty();
    $("save").disabled = !dirty() && !aside && $("path").value === opened.path;
    $("saved").textContent = dirty() ? "not saved" : "";
    showLine();
    if (checking) { checking = "again"; return; }
    checking = true;
    attempt(check)().then(() => {
      const again = checking === "again";
      checking = false;
      if (again) changed();
    });
  }

  async function check() {
    const {path} = opened, {text} = sheet, found = await ask("check", {path, text});
    if (path === opened.path && text === sheet.text) await show(found);
  }

  async function show(found, again = false) {
    const {mistakes, plan, left} = found, count = mistakes.length;
    sheet.mistakes = mistakes;
    $("check").hidden = !left && !again;
    $("verdict").className = count ? "wrong" : left ? "" : "sound";
    $("verdict").textContent = count ? `${count} mistake${count > 1 ? "s" : ""}` : left || "No mistakes";
    $("mistakes").replaceChildren(...mistakes.map(({line, text}) => {
      const entry = element("li"), where = line ? `line ${line}: ` : "";
      entry.append(line ? element("button", where + text, {type: "button", click: () => sheet.go(line)}) : text);
      return entry;
    }));
    if (count || left) return;
    $("words").textContent = plan.join("\n");
    $("plan").hidden = false;
    const number = ++planned, {path} = opened, {text} = sheet;
    if (again) return;
    await new Promise(done => setTimeout(done, 150));
    if (number !== planned || text !== sheet.text) return;
    const {html} = await ask("plan", {path, text, width: Math.max(200, $("plan").clientWidth)});
    if (number === planned && path === opened.path) draw(html);
  }

  function draw(html) {
    if ($("drawn").shown === html) return;
    const drawn = $("drawn");
    drawn.querySelectorAll("figure.live").forEach(live.drop);
    live.maps = [];
    live.spots.length = 0;
    drawn.shown = drawn.innerHTML = html; // the server's own drawing, in which all names are texts
    drawn.querySelectorAll("figure.live").forEach(live.add);
    drawn.querySelectorAll("figure.live_map").forEach(live.map);
  }

  // Saving, and commands

  async function save() {
    const path = $("path").value.trim(), {text} = sheet;
    const {digest} = await ask("save", {path, text, digest: path === opened.path ? opened.digest : ""});
    Object.assign(opened, {path, shipped: false, text, digest});
    $("name").textContent = path;
    history.replaceState(null, "", `#${encodeURIComponent(path)}`);
    trouble("");
    changed();
    $("saved").textContent = "saved";
    await refresh();
  }

  const lines = id => $(id).value.split("\n").map(line => line.trim()).filter(Boolean);

  function wanted() {
    const command = $("command").value, runs = Number($("runs").value), out = $("out").value.trim();
    const paths = [dirty() ? $("path").value.trim() : opened.path], atRest = command === "align" || command === "calibrate";
    return {command, paths, settings: lines("settings"), require: atRest ? [] : lines("require"),
            ...(command === "ensemble" && runs ? {runs} : {}), ...(out ? {out} : {}),
            overwrite: $("overwrite").checked, allow_programs: !atRest && $("allow_programs").checked};
  }

  const quoted = word => /^[\w@%+=:,./-]+$/.test(word) ? word : `'${word.replaceAll("'", `'"'"'`)}'`;

  function showLine() {
    const {command, paths, settings, require, runs, out, overwrite, allow_programs} = wanted();
    const words = [command, ...paths, ...settings.map(one => `--set=${one}`), ...require.map(one => `--require=${one}`),
                   ...(runs ? [`--runs=${runs}`] : []), ...(out ? [`--out=runs/${out}`] : command === "align" ? [`--out=runs/${paths[0]?.split("/").at(-1).replace(/\.toml$/, "")}-alignment`] : []),
                   ...(overwrite ? ["--overwrite"] : []), ...(allow_programs ? ["--allow-programs"] : [])];
    $("line").textContent = opened.path === null ? "" : ["sinssim", ...words.map(quoted)].join(" ");
    $("of-runs").hidden = command !== "ensemble";
    for (const id of ["require", "allow_programs"]) $(id).parentNode.hidden = command === "align" || command === "calibrate";
    $("start").textContent = dirty() ? "Save and start" : "Start";
    $("out").placeholder = `the ${opened.study ? "study" : "scenario"}'s name${ENDINGS[command]}`;
  }

  async function start(asked) {
    trouble("");
    const begun = await ask("start", asked);
    running.set(begun.number, null);
    await follow();
    return begun.number;
  }

  async function checkFile() {
    if (dirty()) await save();
    const number = await start({command: "check", paths: [opened.path]});
    running.set(number, async () => show(await ask("check", {path: opened.path, text: sheet.text, number}), true));
  }

  const time = seconds => seconds < 100 ? `${seconds.toFixed(0)} s` : `${(seconds / 60).toFixed(1)} min`;
  const outcome = ({code, cancelled}) => cancelled ? "cancelled" : code === 0 ? "finished" : `failed, exit code ${code}`;

  function entryOf(one) {
    const entry = element("li"), head = element("div", "", {class: "line"}), {number} = one;
    head.append(element("code", one.command), element("progress", "", {max: 1, "aria-label": `Progress of command ${number}`}),
                element("span", "", {class: "state", role: "status"}), element("a", "Open the view", {target: "_blank", rel: "noopener"}),
                element("button", "Cancel", {type: "button", click: attempt(async () => { await ask("cancel", {number}); await follow(); })}));
    const details = element("details"), output = element("pre", "", {tabindex: 0, "aria-label": `Output of command ${number}`});
    details.append(element("summary", "output"), output);
    entry.append(head, details);
    return Object.assign(entry, {parts: {head, output, details}});
  }

  function showCommand(entry, one) {
    const {head, output, details} = entry.parts, [, bar, state, view, cancel] = head.children, ended = one.code !== null;
    bar.hidden = cancel.hidden = ended;
    if (one.fraction > 0 && !one.page) bar.value = one.fraction; else bar.removeAttribute("value");
    bar.hidden ||= Boolean(one.page);
    const words = ended ? `${outcome(one)} after ${time(one.seconds)}` : one.page ? "is open" : `${one.cancelled ? "is being cancelled" : one.stage || "begins"}, ${time(one.seconds)}`;
    if (state.textContent !== words) state.textContent = words;
    state.classList.toggle("failed", ended && !one.cancelled && one.code !== 0);
    view.hidden = !one.page;
    if (one.page) view.href = one.page;
    cancel.textContent = one.page ? "Close" : one.cancelled ? "Kill" : "Cancel";
    cancel.setAttribute("aria-label", `${cancel.textContent} command ${one.number}`);
    entry.classList.toggle("wrong", ended && one.code !== 0);
    if (output.textContent !== one.output) output.textContent = one.output;
    if (ended && one.code !== 0 && !one.cancelled && !entry.told) { details.open = true; entry.told = true; }
  }

  let due = 0;
  async function follow() {
    clearTimeout(due);
    const {commands} = await ask("commands");
    const entries = new Map([...$("commands").children].map(entry => [entry.number, entry]));
    const shown = commands.map(one => {
      const entry = entries.get(one.number) ?? Object.assign(entryOf(one), {number: one.number});
      showCommand(entry, one);
      return entry;
    });
    if (shown.length !== entries.size || shown.some((entry, k) => $("commands").children[k] !== entry)) $("commands").replaceChildren(...shown);
    let ended = false;
    for (const {number, code} of commands) {
      if (code === null) running.set(number, running.get(number) ?? null);
      else if (running.has(number)) {
        const then = running.get(number);
        running.delete(number);
        ended = true;
        if (then) await then();
      }
    }
    due = setTimeout(attempt(follow), running.size ? 400 : 4000);
    if (ended) await refresh();
  }

  // What has finished

  const size = bytes => bytes < 1e6 ? `${(bytes / 1e3).toFixed(0)} kB` : `${(bytes / 1e6).toFixed(1)} MB`;
  const metres = value => value === null ? "" : value < 1e4 ? `${Number(value.toPrecision(4))} m` : `${(value / 1e3).toFixed(1)} km`;

  function showFinished() {
    const heads = ["", "folder", "result", "scenario", "horizontal rms", "of", "size", "date", "open"];
    const head = element("tr"), rows = lists.runs.map(run => {
      const row = element("tr"), first = element("td"), last = element("td", "", {class: "name"});
      if (run.kind === "run") first.append(element("input", "", {type: "checkbox", value: run.path, "aria-label": `Compare ${run.path}`}));
      const address = run.path.split("/").map(encodeURIComponent).join("/");
      if (run.report) last.append(element("a", "report", {href: `files/${address}/report.html`, target: "_blank", rel: "noopener", "aria-label": `Report of ${run.path}`}), " ");
      if (run.view) last.append(element("button", "view", {type: "button", "aria-label": `View of ${run.path}`,
                                                            click: attempt(() => start({command: "view", paths: [run.path]}))}), " ");
      const text = run.text.replace(".toml", "");
      if (text) last.append(element("button", text, {type: "button", "aria-label": `${text} of ${run.path}`,
                                                     click: attempt(() => choose({path: `${run.path}/${run.text}`, shipped: false}))}));
      const texts = [run.path, run.status && run.status !== "finished" ? `${run.kind}, ${run.status}` : run.kind, run.problem || run.scenario];
      row.append(first, ...texts.map(text => element("td", text, {class: "name"})), element("td", metres(run.error_m)),
                 element("td", run.solution, {class: "name"}), element("td", size(run.bytes)), element("td", run.date), last);
      return row;
    });
    head.append(...heads.map((text, k) => text ? element("th", text, {scope: "col", class: [4, 6, 7].includes(k) ? "" : "name"}) : element("td")));
    const [top, body] = [element("thead"), element("tbody")];
    top.append(head);
    body.append(...rows);
    $("finished").replaceChildren(...(rows.length ? [top, body] : []));
    $("finished").dataset.none = "Nothing yet: choose a scenario, and start a run.";
    $("count").textContent = rows.length ? `${rows.length} in ${lists.folder}/runs` : "";
    $("compare").hidden = rows.length < 2;
  }

  async function refresh() {
    Object.assign(lists, await ask("scenarios"));
    $("folder").textContent = lists.folder;
    showScenarios();
    Object.assign(lists, await ask("runs"));
    showFinished();
  }

  $("find").addEventListener("input", showScenarios);
  $("path").addEventListener("input", changed);
  $("saving").addEventListener("submit", event => { event.preventDefault(); attempt(save)(); });
  $("check").addEventListener("click", attempt(checkFile));
  $("compute").addEventListener("input", showLine);
  $("compute").addEventListener("submit", event => {
    event.preventDefault();
    attempt(async () => { if (dirty()) await save(); await start(wanted()); $("commands").scrollIntoView({block: "nearest"}); })();
  });
  $("compare").addEventListener("click", attempt(() => {
    const paths = [...$("finished").querySelectorAll("input:checked")].map(box => box.value);
    return start({command: "compare-runs", paths, overwrite: true});
  }));
  addEventListener("keydown", event => {
    if (event.key === "s" && (event.ctrlKey || event.metaKey) && opened.path !== null) { event.preventDefault(); attempt(save)(); }
  });
  addEventListener("beforeunload", event => { if (dirty()) event.preventDefault(); });
  $("commands").dataset.none = "None has been started.";
  attempt(async () => {
    await refresh();
    ask("keys").then(({tables}) => { sheet.tables = tables; }); // takes longer: after what is seen
    const path = decodeURIComponent(location.hash.slice(1));
    if (path) await choose(lists.scenarios.find(one => one.path === path) ?? {path, shipped: false});
  })();
  attempt(follow)();
});
