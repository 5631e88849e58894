"use strict";
/** Sliders, messages, files, and what calls what. `window.strip` shows the latest results to other scripts. */
(() => {
  const data = JSON.parse(document.getElementById("data").textContent);
  const { format, quantity, largest } = Plots;
  const { between, resultOf, agreementOf } = Results(data);
  const $ = (id) => document.getElementById(id);
  const make = (tag, attributes = {}, ...children) => {
    const element = document.createElement(tag);
    for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value);
    element.append(...children);
    return element;
  };

  const AT_FIRST = Object.fromEntries(data.sliders.map((s) => [s.name, s.value]));
  const state = { values: { ...AT_FIRST }, drive: { ...data.drive }, measured: null, rows: null, held: null, result: null, agreement: null };
  const page = (window.strip = { data, state, runs: 0, deck: "" });

  // -- messages ------------------------------------------------------------------------------------------------------

  function tell(text) {
    $("message").textContent = text;
    $("message").hidden = !text;
  }

  // -- sliders -------------------------------------------------------------------------------------------------------

  const STEPS = 100;

  /**
   * One slider with its number. `s` as in data.sliders, `get` and `set` its value; even ones go in a straight line.
   */
  function slider(s, get, set) {
    const id = `slider-${s.name}`, even = s.even;
    const middle = s.value, span = even ? s.highest - s.lowest : Math.log(s.highest / s.value);
    const place = (v) => (even ? (v - s.lowest) / span * 2 * STEPS - STEPS : Math.log(v / middle) / span * STEPS);
    const value = (p) => {
      if (p === (even ? place(middle) : 0)) return middle;
      if (p <= -STEPS) return s.lowest;
      if (p >= STEPS) return s.highest;
      const exact = even ? s.lowest + (p + STEPS) / (2 * STEPS) * span : middle * Math.exp(p / STEPS * span);
      return Number(`${Number((exact / s.scale).toPrecision(3))}`) * s.scale;
    };
    const range = make("input", { type: "range", id, min: -STEPS, max: STEPS, step: 1 });
    const number = make("input", { type: "number", step: "any", "aria-label": `${s.label} in ${s.unit || "1"}`, inputmode: "decimal" });
    const shown = (v) => Number((v / s.scale).toPrecision(6));
    const refresh = () => {
      const v = get();
      range.value = place(v);
      range.setAttribute("aria-valuetext", `${shown(v)} ${s.unit}`);
      number.value = shown(v);
    };
    const bounds = `${format(shown(s.lowest))} to ${format(shown(s.highest))} ${s.unit}`;
    range.addEventListener("input", () => {
      const p = Number(range.value), kept = get(), v = value(p);
      const problem = set(v);
      if (problem) { set(kept); refresh(); return tell(problem); }
      refresh();
      tell(Math.abs(p) >= STEPS ? `${s.label} is at the end of its slider (${bounds}); for more change the strip's file and make a new page.` : "");
      changed();
    });
    number.addEventListener("change", () => {
      const v = number.value === "" ? NaN : Number(number.value) * s.scale, kept = get();
      const inside = v >= s.lowest * (1 - 1e-9) - 1e-300 && v <= s.highest * (1 + 1e-9);
      const problem = inside ? set(v) : `${s.label}: ${number.value || "no number"} is outside ${bounds}; the strip stays as it is.`;
      if (problem) { set(kept); refresh(); return tell(problem); }
      refresh();
      tell("");
      changed();
    });
    const meaning = s.meaning ? [make("span", { class: "meaning" }, s.meaning)] : [];
    const element = make("div", { class: "slider" }, make("label", { for: id }, s.label), number, make("span", { class: "unit" }, s.unit), range, ...meaning);
    refresh();
    return { element, refresh };
  }

  /** What is wrong with the strip, in one line; empty where nothing is. */
  function impossible(v) {
    const mm = (x) => `${format(1e3 * x)} mm`;
    if (v.free_length > v.length * (1 + 1e-12)) return `The free length, ${mm(v.free_length)}, cannot exceed the total length, ${mm(v.length)}; the strip stays as it is.`;
    const free = v.free_length;
    if (v.load_position > free * (1 + 1e-12)) return `The load position, ${mm(v.load_position)}, lies beyond the free length, ${mm(free)}; the strip stays as it is.`;
    if (data.gravity) {
      const bending = v.bending_stiffness ?? v.youngs_modulus * v.width * v.thickness ** 3 / 12;
      const ratio = v.density * v.width * v.thickness * 9.80665 * free ** 3 / (8 * bending);
      if (ratio > data.gravity.heavier * data.gravity.ratio) return `This strip would be more than ${data.gravity.heavier} times as heavy for its stiffness as the one the page was made for; the strip stays as it is.`;
    }
    return "";
  }

  const refreshers = [];
  const refresh = () => refreshers.forEach((again) => again());

  function stripSliders() {
    const groups = new Map();
    for (const s of data.sliders) {
      if (!groups.has(s.group)) groups.set(s.group, []);
      const set = (v) => { state.values[s.name] = v; return impossible(state.values); };
      const made = slider(s, () => state.values[s.name], set);
      refreshers.push(made.refresh);
      groups.get(s.group).push(made.element);
    }
    for (const [name, elements] of groups) {
      const group = make("details", { class: "group" }, make("summary", {}, name), ...elements);
      group.open = name === "Geometry" || name === "Electrical material";
      $("strip-sliders").append(group);
    }
  }

  // -- drive ---------------------------------------------------------------------------------------------------------

  const most = Math.max(5, 2 * largest([data.drive.high, data.drive.low, data.drive.amplitude]));
  const volts = (name, label) => ({ name, label, meaning: "", unit: "V", scale: 1, lowest: -most, highest: most, even: true });
  const DRIVE = [
    { ...volts("high", "Voltage"), of: ["step"] },
    { ...volts("high", "Upper voltage"), name: "high", id: "upper", of: ["square", "triangle"] },
    { ...volts("low", "Lower voltage"), of: ["square", "triangle"] },
    { ...volts("amplitude", "Amplitude"), lowest: 0, of: ["sine"] },
    { name: "frequency", label: "Frequency", unit: "Hz", scale: 1, of: ["sine"] },
    { name: "period", label: "Period", unit: "s", scale: 1, of: ["square", "triangle"] },
    { name: "duty", label: "High part of a period", unit: "", scale: 1, lowest: 0.05, highest: 0.95, even: true, of: ["square"] },
    { name: "duration", label: "Duration", unit: "s", scale: 1, of: ["step", "square", "sine", "triangle"] },
  ];

  function notDriven(drive) {
    if (drive.kind !== "sine" && !(drive.low < drive.high) && drive.kind !== "step" && drive.kind !== "measured") return "The upper voltage must be above the lower one; the drive stays as it is.";
    if (Deck.periods(drive) > data.mostPeriods * (1 + 1e-9)) return `That would be ${format(Deck.periods(drive), 3)} periods; a page draws at most ${data.mostPeriods}: shorten the duration first.`;
    return "";
  }

  function driveSliders() {
    for (const given of DRIVE) {
      const value = data.drive[given.name];
      const s = { lowest: value / 10, highest: value * 10, meaning: "", ...given, value, name: given.id ?? given.name };
      const made = slider(s, () => state.drive[given.name], (v) => { state.drive[given.name] = v; return notDriven(state.drive); });
      made.element.dataset.of = given.of.join(" ");
      refreshers.push(made.refresh);
      $("drive-sliders").append(made.element);
    }
    for (const kind of ["step", "square", "sine", "triangle", "measured"]) {
      const radio = make("input", { type: "radio", name: "kind", value: kind, id: `kind-${kind}` });
      radio.addEventListener("change", () => choose(kind));
      const label = make("label", {}, radio, kind === "measured" ? "measured voltage" : kind);
      label.hidden = kind === "measured";
      $("kinds").append(label);
    }
    choose(state.drive.kind, true);
  }

  function choose(kind, first = false) {
    const before = state.drive.kind;
    state.drive.kind = kind;
    const problem = notDriven(state.drive);
    if (problem) state.drive.kind = before;
    $(`kind-${state.drive.kind}`).checked = true;
    for (const element of $("drive-sliders").children) element.hidden = !element.dataset.of.split(" ").includes(state.drive.kind);
    if (first) return;
    tell(problem);
    if (!problem) changed();
  }

  // -- pictures ------------------------------------------------------------------------------------------------------

  /** @type {any[]} with `short`, the name on a tab */
  const PANELS = [
    ...(data.coupled ? [{ id: "displacement", title: "Displacement, tip free", short: "displacement", unit: "m", over: "time" },
      { id: "force", title: "Force, tip blocked", short: "force", unit: "N", over: "time" }] : []),
    { id: "current", title: "Current", short: "current", unit: "A", over: "time" },
    { id: "charge", title: "Charge of the ions", short: "charge", unit: "C", over: "time" },
    { id: "magnitude", title: "Impedance, magnitude", short: "|Z|", unit: "\u03a9", over: "frequency", log: true },
    { id: "phase", title: "Impedance, phase", short: "phase", unit: "\u00b0", over: "frequency" },
    { id: "voltage", title: "Voltage", short: "voltage", unit: "V", over: "time" },
  ];
  const plots = new Map();

  function pictures() {
    for (const panel of PANELS) {
      const canvas = make("div", { class: "canvas", tabindex: 0, role: "img", "aria-label": panel.title });
      const title = make("h2", {}, `${panel.title} `, "(", make("span", { class: "unit" }, panel.unit), ")");
      const element = make("section", { class: "plot", id: `plot-${panel.id}` }, title, make("output", {}), canvas);
      $("plots").append(element);
      plots.set(panel.id, new Plots.Plot(panel, element));
      const tab = make("button", { type: "button", "data-of": panel.id }, panel.short);
      tab.addEventListener("click", () => tabTo(panel.id));
      $("tabs").append(tab);
    }
    tabTo(PANELS[0].id);
    new ResizeObserver(() => plots.forEach((plot) => plot.resize())).observe($("plots"));
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => plots.forEach((plot) => plot.plot?.redraw()));
  }

  function tabTo(id) {
    for (const panel of PANELS) $(`plot-${panel.id}`).classList.toggle("chosen", panel.id === id);
    for (const tab of $("tabs").children) tab.setAttribute("aria-pressed", String(tab.dataset.of === id));
    plots.get(id).resize();
  }

  const curve = (result, panel) => ({ x: panel.over === "time" ? result.time : result.frequency, y: result[panel.id] });

  /** What a picture is said to show: its largest and last value, and how far what was measured is from it. */
  function about(panel, result, measured) {
    const y = result[panel.id];
    if (panel.over === "frequency") {
      return `${quantity(y[0], panel.unit, 3)} at 1 mHz, ${quantity(y[y.length - 1], panel.unit, 3)} at 1 kHz`;
    }
    let peak = 0;
    for (const v of y) if (Math.abs(v) > Math.abs(peak)) peak = v;
    const said = `peak ${quantity(peak, panel.unit, 3)}, at the end ${quantity(y[y.length - 1], panel.unit, 3)}`;
    if (!measured || panel.id === "voltage") return said;
    let sum = 0, n = 0;
    measured.x.forEach((t, k) => {
      if (measured.y[k] === null || t < 0 || t > result.time[result.time.length - 1]) return;
      sum += (measured.y[k] - between(result.time, y, t)) ** 2, n++;
    });
    return n ? `${said}; rms distance of measured ${quantity(Math.sqrt(sum / n), panel.unit, 3)}` : said;
  }

  function draw() {
    const { result, held, measured } = state;
    if (!result) return;
    for (const panel of PANELS) {
      const points = panel.over === "time" && measured?.columns[panel.id] ? { x: measured.time, y: measured.columns[panel.id] } : undefined;
      plots.get(panel.id).show({ model: curve(result, panel), held: held ? curve(held, panel) : undefined, measured: points }, about(panel, result, points));
    }
    $("key-held").hidden = !held;
    $("key-measured").hidden = !measured;
    const last = (name) => result[name][result[name].length - 1];
    const facts = [["Peak current", quantity(largest(result.current), "A", 3)], ["Final charge", quantity(last("charge"), "C", 3)],
      ...(data.coupled ? [["Final displacement", quantity(last("displacement"), "m", 3)], ["Peak blocked force", quantity(largest(result.force), "N", 3)]] : [])];
    if (page.facts === facts.join()) return; // screen readers hear of changes only
    page.facts = facts.join();
    $("facts").replaceChildren(...facts.map(([name, value]) => make("div", {}, make("dt", {}, name), make("dd", {}, value))));
  }

  // -- results -------------------------------------------------------------------------------------------------------

  function stateAgreement(result) {
    const found = (state.agreement = agreementOf(result)), worst = Math.max(...Object.values(found));
    const each = Object.entries(found).map(([name, x]) => `${name} ${x.toExponential(0)}`).join(", ");
    const good = worst <= data.close;
    $("agreement").className = good ? "good" : "bad";
    $("agreement").textContent = good
      ? `Agrees with the native run of ${data.program} (${data.native.engine === "exact" ? "its exact solver" : "its own ngspice"}) within ${worst.toExponential(0)} of the largest value, measured in this browser (${each}).`
      : `Differs from the native run of ${data.program} by up to ${worst.toExponential(0)} of the largest value (${each}): do not rely on this page.`;
  }

  const untouched = () => data.sliders.every((s) => state.values[s.name] === s.value) && Object.entries(data.drive).every(([name, x]) => state.drive[name] === x);

  function show(answer, level) {
    const reached = answer.tran.time[answer.tran.time.length - 1];
    if (!(reached > state.drive.duration * (1 - 1e-6)) && !solver.wish) return fail(`ngspice stopped at ${format(reached)} s`);
    state.result = resultOf(answer, level);
    document.documentElement.dataset.state = solver.wish ? "asked" : level;
    page.runs++;
    draw();
    if (level === "fine" && !solver.wish && !state.agreement && untouched()) stateAgreement(state.result);
    else if (!state.agreement) $("agreement").textContent = "The agreement with the native run is measured with the strip and the drive as they were made.";
    if (level === "draft" && !page.shown) page.shown = performance.now();
    page.drawn = performance.now();
  }

  function fail(why) {
    document.documentElement.dataset.state = "failed";
    tell(`${why.replace(/[.\s]+$/, "")}; the picture is that of the last strip that it could solve.`);
  }

  function deckOf(level) {
    const text = Deck.text(data, state.values, state.drive, state.rows, Deck.accuracy(data, level));
    if (level === "fine") page.deck = $("deck").textContent = text;
    return text;
  }

  const solver = new Solver(deckOf, show, fail);

  /** A ladder's band moves with constants of its ion path, and what is computed of a changed strip's file has its own. */
  function ladderNote() {
    const moved = (data.ladder?.moved ?? []).filter((name) => state.values[name] !== AT_FIRST[name]);
    $("ladder").hidden = !moved.length;
    if (!moved.length) return;
    const [low, high] = data.ladder.band.map((f) => quantity(f, "Hz", 3));
    $("ladder").textContent = `Another ${moved.join(", ").replaceAll("_", " ")} moves the band of the ladder that stands for the ion path (${low} to ${high} for the strip as it was): fast changes may be off by more than 1e-5; make a page of the changed strip for exact numbers.`;
  }

  function changed() {
    ladderNote();
    document.documentElement.dataset.state = "asked";
    solver.ask();
  }

  // -- measured data, files ------------------------------------------------------------------------------------------

  async function take(file) {
    let read;
    try {
      read = Measured.read(await file.text());
    } catch (error) {
      return tell(`${file.name}: ${error.message}.`);
    }
    tell("");
    state.measured = read;
    const names = Object.keys(read.columns);
    let said = `${file.name}: ${read.time.length} rows of ${names.join(", ")}`;
    if (read.ignored.length) said += `; not understood and left out: ${read.ignored.join(", ")}`;
    const known = read.time.filter((t, k) => t >= 0 && (read.columns.voltage?.[k] ?? null) !== null);
    if (known.length > 1) {
      let close = 1e-3;
      while ((state.rows = Measured.lines(read.time, read.columns.voltage, close)).times.length > 300) close *= 2;
      said += `; the model is driven by its voltage, ${state.rows.times.length} lines within ${format(1e3 * close)} mV`;
      state.drive.duration = read.time[read.time.length - 1];
      choose("measured");
    } else if (state.drive.kind === "measured") {
      Object.assign(state.drive, data.drive); // an earlier file's voltage is not this one's
      choose(state.drive.kind);
    } else {
      draw();
    }
    refresh();
    $("kind-measured").parentElement.hidden = known.length < 2;
    $("measured-said").textContent = `${said}.`;
  }

  function save(name, text, type) {
    const address = URL.createObjectURL(new Blob([text], { type }));
    make("a", { href: address, download: name }).click();
    setTimeout(() => URL.revokeObjectURL(address), 10000);
  }

  function csv() {
    const { result } = state;
    const columns = [["time_s", "time"], ["voltage_V", "voltage"], ["current_A", "current"], ["charge_C", "charge"],
      ...(data.coupled ? [["displacement_m", "displacement"], ["force_N", "force"]] : [])];
    const rows = Array.from(result.time, (_, k) => columns.map(([, name]) => result[name][k]).join(","));
    return [columns.map(([header]) => header).join(","), ...rows, ""].join("\n");
  }

  function wire() {
    const stem = data.name.replace(/[^\w.-]+/g, "_") || "strip";
    $("controls").addEventListener("submit", (event) => event.preventDefault());
    $("reset").addEventListener("click", () => {
      Object.assign(state.values, AT_FIRST);
      Object.assign(state.drive, data.drive);
      tell("");
      choose(state.drive.kind);
      refresh();
    });
    $("hold").addEventListener("click", () => {
      state.held = state.held ? null : state.result;
      $("hold").setAttribute("aria-pressed", String(Boolean(state.held)));
      draw();
    });
    $("save-deck").addEventListener("click", () => save(`${stem}.cir`, page.deck, "text/plain"));
    $("save-csv").addEventListener("click", () => state.result && save(`${stem}.csv`, csv(), "text/csv"));
    $("file").addEventListener("change", () => $("file").files[0] && take($("file").files[0]));
    const files = (event) => event.dataTransfer?.types.includes("Files");
    addEventListener("dragover", (event) => { if (files(event)) { event.preventDefault(); document.body.classList.add("dropping"); } });
    addEventListener("dragleave", (event) => { if (!event.relatedTarget) document.body.classList.remove("dropping"); });
    addEventListener("drop", (event) => {
      document.body.classList.remove("dropping");
      if (!event.dataTransfer?.files.length) return;
      event.preventDefault();
      take(event.dataTransfer.files[0]);
    });
  }

  stripSliders();
  driveSliders();
  pictures();
  wire();
  solver.wish = "draft";
  solver.start().catch((error) => { document.documentElement.dataset.state = "failed"; tell(`This page cannot run here: ${error.message}; open it in a current browser.`); });
})();
