"use strict";
/**
 * Parameters and a drive -> a SPICE deck. Pure functions; SI units; numbers are written with all their digits.
 *
 * @typedef {{kind: string, duration: number, high: number, low: number, amplitude: number, frequency: number,
 *   period: number, duty: number}} Drive
 * @typedef {{times: number[], volts: number[]}} Rows   straight lines; a time that stands twice is a jump
 * @typedef {{level: string, options: string, longest: number, perRadian: number}} Accuracy
 */
const Deck = (() => {
  /** Two solutions of every wish: one soon, one within 1e-5 of the largest value. */
  const DRAFT = ".options reltol=1e-6 trtol=1 abstol=1e-10 vntol=1e-8 chgtol=1e-4 method=trap";

  /** @returns {Accuracy} of `level` "draft" or "fine"; `data` is what the page was given */
  function accuracy(data, level) {
    return level === "fine"
      ? { level, options: data.options, longest: data.longest, perRadian: 0.01 }
      : { level, options: DRAFT, longest: 10 * data.longest, perRadian: 0.05 };
  }

  /** @param {Drive} drive @returns {number} periods in its duration; 0 of a step or of measured rows */
  function periods(drive) {
    if (drive.kind === "sine") return drive.duration * drive.frequency;
    return drive.kind === "square" || drive.kind === "triangle" ? drive.duration / drive.period : 0;
  }

  /** @param {Drive} drive @param {Rows | null} measured @returns {Rows} its lines; none of a sine */
  function rows(drive, measured) {
    const { kind, duration, high, low, period, duty } = drive;
    if (kind === "measured" && measured) return measured;
    if (kind === "step") return { times: [0], volts: [high] };
    const times = [], volts = [];
    if (kind === "square") {
      for (let start = 0, k = 0; start < duration; start = ++k * period) {
        if (k) times.push(start), volts.push(low);
        times.push(start, start + duty * period, start + duty * period);
        volts.push(high, high, low);
      }
    } else if (kind === "triangle") {
      const begin = Math.min(Math.max(0, low), high), rise = (high - begin) / (high - low) / 2;
      for (let k = 0; k * period <= duration; k++) {
        times.push(k * period, (k + rise) * period, (k + rise + 0.5) * period);
        volts.push(begin, high, low);
      }
      times.push(times.length / 3 * period), volts.push(begin);
    }
    return { times, volts };
  }

  /**
   * The lines with each jump a ramp of `rise` [s] about it, from 0 to past `duration`; edges at its very end are none.
   * @param {Rows} given @param {number} duration @param {number} rise @returns {Rows}
   */
  function widened(given, duration, rise) {
    const times = [0], volts = [given.volts[0]], end = duration * (1 - 1e-9);
    const n = given.times.length;
    for (let k = 0; k < n; k++) {
      const t = given.times[k];
      if (t <= 0) { volts[0] = given.volts[k]; continue; }
      if (t >= end) {
        const last = given.times[k - 1] ?? 0, before = volts[volts.length - 1];
        const slope = t > last ? (given.volts[k] - given.volts[k - 1]) / (t - last) : 0;
        times.push(2 * duration), volts.push(before + slope * (2 * duration - times[times.length - 2]));
        return { times, volts };
      }
      const first = k;
      while (k + 1 < n && given.times[k + 1] === t) k++;
      if (k === first) { times.push(t), volts.push(given.volts[k]); continue; }
      // of several values at one time the first and the last count
      const next = k + 1 < n ? given.times[k + 1] : 2 * duration;
      const half = Math.min(rise / 2, (t - times[times.length - 1]) / 4, (next - t) / 4);
      times.push(t - half, t + half), volts.push(given.volts[first], given.volts[k]);
    }
    times.push(2 * duration), volts.push(volts[volts.length - 1]);
    return { times, volts };
  }

  /** @returns {string} the waveform as SPICE writes it */
  function waveform(drive, measured, rise) {
    if (drive.kind === "sine") return `SIN(0 ${drive.amplitude} ${drive.frequency})`;
    const lines = widened(rows(drive, measured), drive.duration, rise);
    return `PWL(${lines.times.map((t, k) => `${t} ${lines.volts[k]}`).join(" ")})`;
  }

  /** @returns {string[]} long lines continued with + */
  function folded(line) {
    const lines = [];
    let rest = line;
    while (rest.length > 100) {
      const cut = rest.lastIndexOf(" ", 100);
      if (cut < 3) break;
      lines.push(rest.slice(0, cut));
      rest = `+${rest.slice(cut)}`;
    }
    return [...lines, rest];
  }

  /** @returns {string[]} the vectors that a run keeps, by what they are */
  function vectors(data) {
    const charge = data.charge.flatMap((c) => [`v(xfree.${c.node})`,
      ...(c.capacitor ? [`@c.xfree.${c.capacitor}[capacitance]`] : [])]);
    return ["v(plus)", "i(vfree)", ...charge, ...(data.coupled ? ["v(xfree.way)", "v(blocked)"] : [])];
  }

  /**
   * @param {object} data what the page was given
   * @param {Object<string, number>} values parameters by name, SI units
   * @param {Drive} drive @param {Rows | null} measured @param {Accuracy} how
   * @returns {string} a deck that `ngspice -b` runs as well
   */
  function text(data, values, drive, measured, how) {
    const changed = data.sliders.filter((s) => values[s.name] !== s.value).map((s) => `${s.name}=${values[s.name]}`);
    const strip = (name, pins) => folded([name, ...pins, "ilg_strip", ...changed].join(" "));
    const [low, high, points] = data.band, T = drive.duration;
    const omega = drive.kind === "sine" ? 2 * Math.PI * drive.frequency : 0;
    const longest = Math.min(how.longest * T, omega ? how.perRadian / omega : Infinity);
    const said = data.coupled
      ? ["* one strip with its tip free: v(xfree.way) is the way of the tip in mm; another with its tip blocked:",
        "* v(blocked) is its force in uN; i(vfree) is the current into the free one"]
      : ["* i(vfree) is the current into the strip"];
    return [
      `* ${data.program}: strip in a browser`,
      ...data.origin.slice(1).map((line) => `* ${line.replace(/[^ -~]/g, "_")}`),
      ...said,
      "* run with: ngspice -b FILE",
      data.library.trimEnd(),
      ...folded(`Vdrive plus 0 DC 0 AC 1 ${waveform(drive, measured, data.rise)}`),
      "Vfree plus free 0",
      ...strip("Xfree", data.coupled ? ["free", "0", "tip"] : ["free", "0"]),
      ...(data.coupled ? ["Vtip tip 0 0", ...strip("Xheld", ["plus", "0", "blocked"])] : []),
      "* a corner in a source makes the first step short: its error is the only one that ngspice does not check",
      `Vstart start 0 PWL(0 0 ${T * data.first} 0 ${2 * T} 0)`,
      how.options,
      `.save ${vectors(data).join(" ")}`,
      `.print tran ${vectors(data).filter((v) => !v.startsWith("@")).join(" ")}`,
      ".print ac i(vfree)",
      `.ac dec ${points} ${low} ${high}`,
      `.tran ${data.first * T} ${T} 0 ${longest} uic`,
      ".end",
      "",
    ].join("\n");
  }

  return { accuracy, periods, rows, text, widened };
})();
