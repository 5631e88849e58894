"use strict";
/**
 * A measured CSV file -> columns in SI units, or an Error whose message says in one line what is wrong with it.
 *
 * @typedef {{time: number[], columns: Object<string, (number | null)[]>, ignored: string[]}} Measured
 */
const Measured = (() => {
  const PREFIXES = { "": 1, k: 1e3, m: 1e-3, u: 1e-6, "\u00b5": 1e-6, "\u03bc": 1e-6, n: 1e-9 };
  const UNITS = { time: "s", voltage: "V", current: "A", charge: "C", displacement: "m", force: "N" };
  const LARGEST = 20e6;
  const shown = (text) => JSON.stringify(text.trim().slice(0, 40));

  /** @returns {{name: string, scale: number} | null} what a header such as current_mA means */
  function meaning(header) {
    const parts = /^\s*"?\s*(?:laser_)?([a-z]+)\s*[_ ]\s*[([]?\s*([^\s)\]"]*?)\s*[)\]]?\s*"?\s*$/i.exec(header);
    const name = parts?.[1].toLowerCase(), unit = name && UNITS[name];
    if (!unit) return null;
    if (name === "time" && parts[2] === "min") return { name, scale: 60 };
    const scale = parts[2].endsWith(unit) ? PREFIXES[parts[2].slice(0, -unit.length)] : undefined;
    if (scale === undefined) throw new Error(`column ${shown(header)}: its unit is not understood; write ${name}_${unit} or ${name}_m${unit}`);
    return { name, scale };
  }

  /** @param {string} text @returns {Measured} */
  function read(text) {
    if (text.length > LARGEST) throw new Error(`it is larger than ${LARGEST / 1e6} MB; leave out rows`);
    if (text.includes("\u0000")) throw new Error("it is no text; save the table as CSV");
    const lines = text.replace(/^\ufeff/, "").split(/\r\n|\n|\r/)
      .map((line, k) => ({ line, number: k + 1 })).filter(({ line }) => line.trim() && !line.startsWith("#"));
    if (lines.length < 2) throw new Error("it has no rows; the first row names the columns, such as time_s,current_mA");
    const separator = [";", "\t", ","].find((s) => lines[0].line.includes(s)) ?? ",";
    const headers = lines[0].line.split(separator), kinds = headers.map(meaning);
    const names = kinds.filter(Boolean).map((kind) => kind.name);
    const twice = names.find((name, k) => names.indexOf(name) !== k);
    if (twice) throw new Error(`two of its columns are a ${twice}; leave one`);
    if (!names.includes("time")) throw new Error(`it has no column time_s; the first row reads ${shown(lines[0].line)}`);
    if (names.length < 2) throw new Error("besides time it has no column such as voltage_V, current_mA or displacement_mm");
    const columns = Object.fromEntries(names.map((name) => [name, []]));
    for (const { line, number } of lines.slice(1)) {
      const cells = line.split(separator);
      if (cells.length !== headers.length) throw new Error(`row ${number} has ${cells.length} cells, the header ${headers.length}`);
      kinds.forEach((kind, k) => {
        if (!kind) return;
        const cell = cells[k].trim().replace(/^"(.*)"$/, "$1");
        const value = Number(separator === "," ? cell : cell.replace(",", "."));
        if (cell && !Number.isFinite(value)) throw new Error(`row ${number}, column ${headers[k].trim()}: ${shown(cell)} is no number`);
        if (!cell && kind.name === "time") throw new Error(`row ${number} has no time`);
        columns[kind.name].push(cell ? value * kind.scale : null);
      });
      const { time } = columns, n = time.length;
      if (n > 1 && time[n - 1] < time[n - 2]) throw new Error(`row ${number}: time goes back from ${time[n - 2]} s to ${time[n - 1]} s`);
    }
    const { time, ...others } = columns;
    if (time.length < 2 || time[time.length - 1] <= Math.max(0, time[0])) throw new Error("it needs two rows or more, after time 0");
    return { time, columns: others, ignored: headers.filter((_, k) => !kinds[k]).map((header) => header.trim()) };
  }

  /**
   * The measured voltage as few straight lines: within `close` [V] of every row.
   * @param {number[]} time @param {(number | null)[]} volts @param {number} close @returns {{times: number[], volts: number[]}}
   */
  function lines(time, volts, close) {
    const known = time.map((t, k) => k).filter((k) => volts[k] !== null && time[k] >= 0);
    const kept = new Set([known[0], known[known.length - 1]]), stack = [[0, known.length - 1]];
    while (stack.length) {
      const [a, b] = stack.pop();
      const [ka, kb] = [known[a], known[b]];
      let worst = close, at = -1;
      for (let i = a + 1; i < b; i++) {
        const k = known[i], span = time[kb] - time[ka];
        const straight = span > 0 ? volts[ka] + (volts[kb] - volts[ka]) * (time[k] - time[ka]) / span : volts[ka];
        const off = Math.abs(volts[k] - straight);
        if (off > worst) worst = off, at = i;
      }
      if (at >= 0) kept.add(known[at]), stack.push([a, at], [at, b]);
    }
    const chosen = known.filter((k) => kept.has(k));
    return { times: chosen.map((k) => time[k]), volts: chosen.map((k) => volts[k]) };
  }

  return { read, lines };
})();
