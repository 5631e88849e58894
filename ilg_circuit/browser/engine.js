"use strict";
/**
 * ngspice in a worker. It is told {program} once, then {id, deck}; it answers {ready}, {id, tran, ac} or {id, error}.
 * tran and ac are vectors by name, Float64Array; a complex vector has its parts in turn.
 */
/* global ngspiceModule */
let engine = null;

/** Starts the program, which from then on waits for commands. @param {WebAssembly.Module} program */
async function start(program) {
  const said = [];
  let commands = [], wake = null, done = null;
  const listen = (line) => said.push(line);
  const module = await ngspiceModule({
    noInitialRun: true,
    print: listen,
    printErr: listen,
    instantiateWasm: (imports, receive) => {
      WebAssembly.instantiate(program, imports).then(receive);
      return {};
    },
  });
  module.FS.writeFile("/spinit", "* none\n");
  module.FS.writeFile("/proc/meminfo", "MemTotal: 2097152 kB\nMemFree: 2097152 kB\nMemAvailable: 2097152 kB\n");
  module.setGetInput(() => commands.shift() ?? " ");
  // called before each command is read: with none left, the run is over
  module.setHandleThings(() => {
    module.Asyncify.handleAsync(async () => {
      if (commands.length) return;
      done?.();
      await new Promise((resolve) => { wake = resolve; });
    });
  });
  const ready = new Promise((resolve) => { done = resolve; });
  module.runThings();
  await ready;
  const run = (given) => {
    said.length = 0;
    commands = [...given];
    const over = new Promise((resolve) => { done = resolve; });
    wake();
    return over;
  };
  return { files: module.FS, said, run };
}

/** @param {Uint8Array} raw @returns {Object<string, Float64Array>} the vectors of ngspice's binary file */
function vectorsOf(raw) {
  const mark = "Binary:\n";
  let end = 0;
  const text = new TextDecoder("latin1").decode(raw.subarray(0, 20000));
  end = text.indexOf(mark) + mark.length;
  const lines = text.slice(0, end).split("\n");
  const number = (key) => Number(lines.find((line) => line.startsWith(key)).split(":")[1]);
  const count = number("No. Variables"), points = number("No. Points");
  const parts = lines.some((line) => line.startsWith("Flags") && line.includes("complex")) ? 2 : 1;
  const first = lines.indexOf("Variables:") + 1;
  const names = lines.slice(first, first + count).map((line) => line.trim().split(/\s+/)[1]);
  const numbers = new Float64Array(raw.slice(end, end + 8 * count * points * parts).buffer);
  const found = {};
  names.forEach((name, place) => {
    const values = new Float64Array(points * parts);
    for (let k = 0; k < points; k++) {
      for (let p = 0; p < parts; p++) values[k * parts + p] = numbers[(k * count + place) * parts + p];
    }
    found[name.toLowerCase()] = values;
  });
  return found;
}

/** What ngspice complained of, in one line. @param {string[]} said */
function complaint(said) {
  const lines = said.map((line) => line.replace(/^ngspice \d+ -> /, "").trim());
  return lines.find((line) => /timestep too small|singular|no convergence|trouble/i.test(line))
    ?? lines.find((line) => /error/i.test(line)) ?? "it gave no reason";
}

async function solve(id, deck) {
  const { files, said, run } = engine;
  const outputs = ["/tran.raw", "/ac.raw"];
  // what an earlier run left would be read as this one's
  outputs.forEach((path) => { if (files.analyzePath(path).exists) files.unlink(path); });
  files.writeFile("/page.cir", deck);
  await run(["source /page.cir", "run", "setplot tran1", "write /tran.raw", "setplot ac1", "write /ac.raw",
    "destroy all", "remcirc"]);
  if (!outputs.every((path) => files.analyzePath(path).exists)) return { id, error: complaint(said) };
  const [tran, ac] = outputs.map((path) => vectorsOf(files.readFile(path)));
  // without a run there is no such plot, and the program writes its constants
  const stopped = said.some((line) => /simulation\(s\) aborted|timestep too small/i.test(line));
  return stopped || !tran.time || !ac.frequency ? { id, error: complaint(said) } : { id, tran, ac };
}

self.onmessage = async ({ data }) => {
  try {
    if (data.program) {
      engine = await start(data.program);
      self.postMessage({ ready: true });
    } else {
      self.postMessage(await solve(data.id, data.deck));
    }
  } catch (error) {
    self.postMessage({ id: data.id, error: String(error?.message ?? error), broken: true });
  }
};
