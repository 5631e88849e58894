"use strict";
/**
 * Pictures, one a quantity, by uPlot: the model as a line, a held curve as a dashed one, what was measured as circles.
 *
 * @typedef {{x: ArrayLike<number>, y: ArrayLike<number | null>}} Curve
 * @typedef {{id: string, title: string, unit: string, over: "time" | "frequency", log?: boolean}} Panel
 */
/* global uPlot */
const Plots = (() => {
  const PREFIXES = { "-15": "f", "-12": "p", "-9": "n", "-6": "\u00b5", "-3": "m", 0: "", 3: "k", 6: "M", 9: "G" };
  const ink = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();

  /** @returns {string} a number of `digits` digits as one writes it */
  function format(value, digits = 4) {
    if (!Number.isFinite(value)) return "\u2013";
    const size = Math.abs(value);
    const text = size && (size < 1e-3 || size >= 1e6) ? value.toExponential(digits - 1) : String(Number(value.toPrecision(digits)));
    return text.replace("-", "\u2212");
  }

  /** @returns {{unit: string, scale: number}} the unit with the prefix that suits a size */
  function suited(size, unit) {
    if (unit === "\u00b0" || !size) return { unit, scale: 1 };
    const exponent = Math.min(9, Math.max(-15, 3 * Math.floor(Math.log10(size) / 3 + 1e-9)));
    return { unit: PREFIXES[exponent] + unit, scale: Number(`1e${exponent}`) };
  }

  /** @returns {string} a quantity with its unit and a suitable prefix */
  function quantity(value, unit, digits = 4) {
    const shown = suited(Math.abs(value), unit);
    return `${format(value / shown.scale, digits)}\u00a0${shown.unit}`;
  }

  const largest = (values) => {
    let most = 0;
    for (const value of values) if (value !== null && Math.abs(value) > most) most = Math.abs(value);
    return most;
  };

  class Plot {
    /** @param {Panel} panel @param {HTMLElement} place */
    constructor(panel, place) {
      Object.assign(this, { panel, place, curves: {}, unit: panel.unit, scale: 1, plot: null, about: "" });
      this.canvas = place.querySelector(".canvas");
      this.readout = place.querySelector("output");
      this.canvas.addEventListener("keydown", (event) => this.key(event));
      this.canvas.addEventListener("focus", () => this.point(this.plot?.cursor.idx ?? 0));
    }

    /** @param {{model: Curve, held?: Curve, measured?: Curve}} curves @param {string} about what to say of it */
    show(curves, about) {
      this.curves = curves;
      this.about = about;
      const all = [curves.model, curves.held, curves.measured].map((curve) => curve ?? { x: [], y: [] });
      const shown = this.panel.log ? { unit: this.panel.unit, scale: 1 } : suited(largest(all.flatMap((c) => [largest(c.y)])), this.panel.unit);
      Object.assign(this, shown);
      const scaled = all.map(({ x, y }) => [Array.from(x), Array.from(y, (v) => (v === null ? null : v / this.scale))]);
      const data = uPlot.join(scaled.filter(([x], k) => x.length || k === 0));
      const wanted = scaled.map(([x], k) => x.length > 0 || k === 0);
      this.place.querySelector(".unit").textContent = this.unit;
      this.canvas.setAttribute("aria-label", `${this.panel.title}: ${about}`);
      this.readout.textContent = about;
      if (this.plot && wanted.join() === this.wanted) return this.plot.setData(data);
      this.plot?.destroy();
      this.wanted = wanted.join();
      this.plot = new uPlot(this.options(wanted), data, this.canvas);
    }

    options(wanted) {
      const time = this.panel.over === "time";
      const font = "12px system-ui, sans-serif", values = (_, ticks) => ticks.map((v) => (v === null ? "" : format(v, 6)));
      const axis = { stroke: () => ink("--soft"), font, grid: { stroke: () => ink("--line"), width: 1 }, ticks: { stroke: () => ink("--line"), width: 1, size: 4 } };
      const logarithmic = { values: this.decades, splits: this.powers };
      const series = [
        { stroke: () => ink("--model"), width: 2, spanGaps: true, points: { show: false } },
        { stroke: () => ink("--soft"), width: 1.5, dash: [6, 5], spanGaps: true, points: { show: false } },
        { stroke: () => ink("--measured"), paths: () => null, points: { show: true, size: 6, width: 1.5, fill: "transparent", stroke: () => ink("--measured") } },
      ].filter((_, k) => wanted[k]);
      const flat = (u, low, high) => {
        if (low === null) return [0, 1];
        if (high - low < 1e-9 * Math.max(Math.abs(low), Math.abs(high))) return [Math.min(0, 1.1 * low), Math.max(0, 1.1 * high) || 1];
        return uPlot.rangeNum(low, high, 0.08, true);
      };
      return {
        ...this.size(),
        legend: { show: false },
        padding: [10, 22, 0, 0],
        cursor: { y: false, drag: { x: false, y: false }, points: { size: 7 }, sync: { key: this.panel.over, setSeries: false } },
        scales: { x: { time: false, distr: time ? 1 : 3, range: (_, low, high) => [time ? Math.min(0, low) : low, high] }, y: this.panel.log ? { distr: 3 } : { range: flat } },
        series: [{}, ...series],
        axes: [
          { ...axis, label: time ? "time (s)" : "frequency (Hz)", labelFont: font, labelSize: 18, size: 28, ...(time ? { values } : logarithmic) },
          { ...axis, size: 56, ...(this.panel.log ? logarithmic : { values }) },
        ],
        hooks: { setCursor: [(u) => this.read(u)] },
      };
    }

    /** Powers of ten, and how they are written. */
    decades = (_, ticks) => ticks.map((v) => (v === null ? "" : v >= 1e-3 && v <= 1e6 ? format(v) : v.toExponential(0).replace("e", "\u00b710^")));

    powers = (_, __, low, high) => {
      const first = Math.ceil(Math.log10(low) - 1e-9), last = Math.floor(Math.log10(high) + 1e-9);
      return Array.from({ length: Math.max(0, last - first + 1) }, (_, k) => Number(`1e${first + k}`));
    };

    size() {
      return { width: Math.max(200, this.canvas.clientWidth), height: Math.max(120, this.canvas.clientHeight) };
    }

    resize() {
      if (this.canvas.clientWidth) this.plot?.setSize(this.size());
    }

    read(u) {
      const k = u.cursor.idx;
      if (k === null || k === undefined) { this.readout.textContent = this.about; return; }
      const [x, ...ys] = u.data, at = this.panel.over === "time" ? "s" : "Hz";
      const names = ["model", "held", "measured"].filter((_, s) => this.wanted.split(",")[s] === "true");
      const said = ys.map((y, s) => [names[s], nearest(y, k)]).filter(([, value]) => value !== null)
        .map(([name, value]) => `${names.length > 1 ? `${name} ` : ""}${format(value)}\u00a0${this.unit}`);
      this.readout.textContent = `${said.join(", ")} at ${format(x[k])}\u00a0${at}`;
    }

    /** Move the cursor to a point of the curve. */
    point(k) {
      if (!this.plot) return;
      const [x, y] = this.plot.data, at = Math.min(Math.max(k, 0), x.length - 1);
      this.plot.setCursor({ left: this.plot.valToPos(x[at], "x"), top: this.plot.valToPos(nearest(y, at) ?? 0, "y") });
    }

    key(event) {
      const n = this.plot?.data[0].length ?? 0, now = this.plot?.cursor.idx ?? 0;
      const [x] = this.plot?.data ?? [[]];
      // an even way along the picture, for the points are where the solver had them
      const position = this.plot?.valToPos(x[now], "x") ?? 0, width = this.plot?.over.clientWidth ?? 1;
      const to = (part) => this.plot.posToIdx(Math.min(Math.max(position + part * width, 0), width));
      const moves = { ArrowRight: () => Math.max(now + 1, to(0.01)), ArrowLeft: () => Math.min(now - 1, to(-0.01)), PageDown: () => to(-0.1), PageUp: () => to(0.1), Home: () => 0, End: () => n - 1 };
      if (!n || !moves[event.key]) return;
      event.preventDefault();
      this.point(moves[event.key]());
    }
  }

  /** The value at a place, or the nearest one that there is. */
  function nearest(y, k) {
    for (let d = 0; d < 40; d++) {
      if (y[k - d] !== null && y[k - d] !== undefined) return y[k - d];
      if (y[k + d] !== null && y[k + d] !== undefined) return y[k + d];
    }
    return null;
  }

  return { Plot, format, quantity, largest };
})();
