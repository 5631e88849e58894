"use strict";
/**
 * The page's side of the engine: of wishes that wait only the latest is solved, first as a draft, then finely once no
 * newer one has come for a moment. A run that takes too long is ended, and the engine started anew.
 */
class Solver {
  /** Longest run [s], and rest [ms] before the fine one. */
  static LONGEST = 15;
  static REST = 250;

  /**
   * @param {(level: string) => string} deckOf the deck of the present wish
   * @param {(result: object, level: string) => void} show
   * @param {(why: string) => void} fail
   */
  constructor(deckOf, show, fail) {
    Object.assign(this, { deckOf, show, fail, worker: null, ready: false, running: null, wish: null, timer: 0, id: 0 });
  }

  /** Unpacks the program from the page and starts the engine. Throws where the browser cannot. */
  async start() {
    if (typeof DecompressionStream === "undefined" || typeof WebAssembly === "undefined") {
      throw new Error("this browser has no WebAssembly or no DecompressionStream");
    }
    const packed = Uint8Array.from(atob(document.getElementById("program").textContent.trim()), (c) => c.charCodeAt(0));
    const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("gzip"));
    this.program = await WebAssembly.compile(await new Response(stream).arrayBuffer());
    this.source = new Blob([JSON.parse(document.getElementById("worker").textContent)], { type: "text/javascript" });
    this.begin();
  }

  begin() {
    const address = URL.createObjectURL(this.source);
    this.worker = new Worker(address);
    this.worker.onmessage = ({ data }) => this.answered(data);
    this.worker.onerror = (event) => this.broken(event.message);
    this.worker.postMessage({ program: this.program });
  }

  /** The present wish has changed. */
  ask() {
    clearTimeout(this.timer);
    this.wish = "draft";
    this.next();
  }

  next() {
    if (!this.ready || this.running || !this.wish) return;
    const level = this.wish;
    this.wish = null;
    this.running = { id: ++this.id, level, limit: setTimeout(() => this.late(), 1000 * Solver.LONGEST) };
    try {
      this.worker.postMessage({ id: this.id, deck: this.deckOf(level) });
    } catch (error) {
      this.over();
      this.fail(String(error?.message ?? error));
    }
  }

  over() {
    clearTimeout(this.running?.limit);
    this.running = null;
  }

  answered(data) {
    if (data.ready) {
      this.ready = true;
    } else if (data.broken) {
      return this.broken(data.error);
    } else if (this.running && data.id === this.running.id) {
      const { level } = this.running;
      this.over();
      if (!this.wish) {
        if (data.error) this.fail(`ngspice cannot solve this strip: ${data.error}`);
        else if (level === "draft") this.timer = setTimeout(() => { this.wish = "fine"; this.next(); }, Solver.REST);
      }
      if (!data.error) this.show(data, level);
    }
    this.next();
  }

  broken(why) {
    this.again();
    this.fail(`ngspice was lost (${why})`);
  }

  late() {
    this.again();
    this.fail(`this strip takes ngspice more than ${Solver.LONGEST} s here`);
  }

  again() {
    this.over();
    this.worker?.terminate();
    this.ready = false;
    this.begin();
  }
}
