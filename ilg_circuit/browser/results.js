"use strict";
/**
 * What the engine answers -> curves in SI units, and how far they are from the native run.
 *
 * @typedef {Object<string, Float64Array> & {level: string}} Result
 * @param {object} data what the page was given
 */
const Results = (data) => {
  const { largest } = Plots;

  /** A smooth curve between points, by a cubic through four of them. */
  function between(x, y, at) {
    let low = 0, high = x.length - 1;
    while (high - low > 1) {
      const middle = (low + high) >> 1;
      if (x[middle] <= at) low = middle; else high = middle;
    }
    const first = Math.min(Math.max(low - 1, 0), x.length - 4);
    let sum = 0;
    for (let i = first; i < first + 4; i++) {
      let part = y[i];
      for (let j = first; j < first + 4; j++) if (j !== i) part *= (at - x[j]) / (x[i] - x[j]);
      sum += part;
    }
    return sum;
  }

  /** @returns {Result} */
  function resultOf({ tran, ac }, level) {
    const time = tran.time, n = time.length, charge = new Float64Array(n);
    for (const { node, capacitor } of data.charge) {
      const volts = tran[`v(xfree.${node})`], size = capacitor ? tran[`@c.xfree.${capacitor}[capacitance]`][n - 1] : 1;
      for (let k = 0; k < n; k++) charge[k] += size * volts[k];
    }
    const result = { level, time, voltage: tran["v(plus)"], current: tran["i(vfree)"], charge };
    if (data.coupled) {
      result.displacement = tran["v(xfree.way)"].map((v) => 1e-3 * v);
      result.force = tran["v(blocked)"].map((v) => 1e-6 * v);
    }
    const points = ac.frequency.length / 2, every = (f) => Float64Array.from({ length: points }, (_, k) => f(ac["i(vfree)"][2 * k], ac["i(vfree)"][2 * k + 1], k));
    result.frequency = every((_re, _im, k) => ac.frequency[2 * k]);
    result.re = every((re, im) => re / (re * re + im * im));
    result.im = every((re, im) => -im / (re * re + im * im));
    result.magnitude = every((re, im) => 1 / Math.hypot(re, im));
    result.phase = every((re, im) => Math.atan2(-im, re) * 180 / Math.PI);
    return result;
  }

  /** The largest difference of each quantity from the native run, relative to its largest value. */
  function agreementOf(result) {
    const { time, re, im, ...waves } = data.native.values;
    const found = {};
    for (const [name, values] of Object.entries(waves)) {
      found[name] = largest(values.map((v, k) => v - between(result.time, result[name], time[k]))) / (largest(values) || 1);
    }
    found.impedance = Math.max(...re.map((x, k) => Math.hypot(x - result.re[k], im[k] - result.im[k]) / Math.hypot(x, im[k])));
    return found;
  }

  return { between, resultOf, agreementOf };
};
