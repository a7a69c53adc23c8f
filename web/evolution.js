// An evolution in the page: its runs are shared out among workers, which advance in slices. Neither changes a bit of it.
// @ts-check
import { Engine, HANDS, lead } from "./engine.js";

/** How long a slice is to take, in ms: progress and stops are heard of in between. */
const SLICE_MS = 80;

/**
 * @typedef {{ best_ever: number, species: number, links_mean: number, evaluations: number, best: number, mean: number }} Generation
 * @typedef {{ run: number, best: number, trial: { mean: number, sd: number }, withheld: string | null, links: number, file: string }} Champion
 */

export class Evolution {
  /**
   * @param {{ task: any, kind: string, model?: object, beans?: object, evolution: any, seed: number }} plan
   * @param {(view: any) => void} tell hears how far it is
   */
  constructor(plan, tell) {
    this.plan = plan;
    this.tell = tell;
    this.isStopped = false;
    /** @type {Generation[][]} */
    this.histories = Array.from({ length: plan.evolution.runs }, () => []);
    /** @type {Champion[]} */
    this.champions = [];
    this.chosen = 0;
    /** @type {Engine[]} */
    this.hands = [];
    this.began = performance.now();
    this.shownAt = 0;
  }

  /** Does all of it; gives the champion's file, or null if it was stopped. @returns {Promise<string | null>} */
  async run() {
    const { task, kind, model = {}, beans = {}, evolution, seed } = this.plan;
    const { file } = await lead.ask({ fit: { kind, model, beans } });
    if (this.isStopped) return null;
    const runs = Array.from({ length: evolution.runs }, (_, run) => run);
    const count = Math.min(HANDS, runs.length);
    this.hands = Array.from({ length: count }, () => new Engine());
    try {
      this.began = performance.now();
      await Promise.all(
        this.hands.map(async (hand, place) => {
          await hand.ask({ model: { file } });
          const own = runs.filter((run) => run % count === place);
          await hand.ask({ begin: { task, evolution, seed, own } });
          await this.advance(hand);
        }),
      );
      if (this.isStopped) return null;
      const parts = await Promise.all(this.hands.map((hand) => hand.ask({ finish: {} })));
      this.champions = parts.flat().sort((one, other) => one.run - other.run);
      this.chosen = (await lead.ask({ choose: { trials: this.champions.map(({ trial }) => trial) } })).run;
      await this.show(true);
      return this.champions[this.chosen].file;
    } catch (error) {
      if (this.isStopped) return null;
      throw error;
    } finally {
      this.hands.forEach((hand) => hand.end());
      this.hands = [];
    }
  }

  /** @param {Engine} hand */
  async advance(hand) {
    let generations = 1;
    for (;;) {
      const began = performance.now();
      const { runs, is_done: isDone } = await hand.ask({ advance: { generations } });
      for (const { run, generations: news } of runs) this.histories[run].push(...news);
      if (isDone || this.isStopped) return;
      const took = performance.now() - began;
      generations = Math.max(1, Math.min(50, Math.round((generations * SLICE_MS) / Math.max(1, took))));
      if (began - this.shownAt > 250) {
        this.shownAt = began;
        await this.show(false);
      }
    }
  }

  /** Tells the curves so far. @param {boolean} isOver */
  async show(isOver) {
    const shown = ({ best_ever, species, links_mean, evaluations }) => ({ best_ever, species, links_mean, evaluations });
    // As far as all runs are: a worker may be ahead of another.
    const common = Math.min(...this.histories.map(({ length }) => length));
    const curves = await lead.ask({ curves: { runs: this.histories.map((history) => history.slice(0, common).map(shown)) } });
    const seconds = (performance.now() - this.began) / 1000;
    this.tell({
      ...curves,
      state: isOver ? "over" : "live",
      generations: this.plan.evolution.generations,
      total: this.plan.evolution.generations * this.histories.length,
      rate: isOver ? null : Math.round(curves.evaluations / Math.max(0.1, seconds)),
      seconds,
      results: isOver ? { champion: this.chosen, runs: this.champions } : null,
    });
  }

  /** The best network so far, as a champion's file. @returns {Promise<string>} */
  async best() {
    const found = await Promise.allSettled(this.hands.map((hand) => hand.ask({ best: {} })));
    const known = found.flatMap((one) => (one.status === "fulfilled" ? [one.value] : []));
    if (!known.length) throw new Error("No champion yet: the evolution has just begun.");
    return known.reduce((one, other) => (other.fitness > one.fitness ? other : one)).champion;
  }

  stop() {
    this.isStopped = true;
    this.hands.forEach((hand) => hand.end());
  }
}
