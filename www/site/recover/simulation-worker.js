/**
 * A worker with the module `simulation`: one scene and its photographs, or the analysis of one transport.
 *
 * A message is `{ id, method, args }`; the answer is `{ id, result }` or `{ id, error, code }`, after any number of
 * `{ id, progress }` from 0 to 1.
 *
 * @typedef {import('./simulation-types.js').SimulationModule} SimulationModule
 * @typedef {import('./simulation-types.js').Simulation} Simulation
 * @typedef {import('./simulation-types.js').TransportAnalysis} TransportAnalysis
 */

/** Cells along each side of the band's picture. */
const BAND_CELLS = 256;

const url = (/** @type {string} */ name) => new URL(`../wasm/${name}`, import.meta.url);

/** @type {Promise<SimulationModule> | undefined} */
let loading;
/** @type {Simulation | undefined} */
let simulation;
/** @type {TransportAnalysis | undefined} */
let analysis;

function load() {
  loading ??= start();
  return loading;
}

/** @returns {Promise<SimulationModule>} */
async function start() {
  try {
    const module = await import(url('simulation.js').href);
    await module.default({ module_or_path: url('simulation_bg.wasm') });
    return module;
  } catch (cause) {
    throw Object.assign(new Error(String(cause)), { code: 'simulation-unavailable' });
  }
}

/** @template T @param {T | undefined} value @returns {T} */
function existing(value) {
  if (value === undefined) throw new Error('the worker has not been given a scene or transport');
  return value;
}

/** @typedef {{ scene: string, side: number, lightSide: number }} SceneSettings */
/** @typedef {{ ensemble: string, count: number, electrons: number, seed: number }} PhotographSettings */
/** @typedef {{ x: number, y: number, width: number, height: number, values: Float32Array }} TileFunctions */
/** @typedef {{ width: number, height: number, lightWidth: number, lightHeight: number, window: number, correspondence: Float64Array }} TransportGeometry */

/** @typedef {(share: number) => void} Report */

const methods = {
  /** @param {SceneSettings} settings @param {Report} report */
  async build({ scene, side, lightSide }, report) {
    const { Simulation } = await load();
    simulation?.free();
    const tiles = Math.ceil(side / 32) ** 2;
    simulation = Simulation.build(scene, side, side, lightSide, lightSide, (done) =>
      report(done / tiles),
    );
    const { window, correspondence } = simulation;
    return { window, correspondence };
  },

  /** @param {PhotographSettings} settings @param {Report} report */
  photograph({ ensemble, count, electrons, seed }, report) {
    const scene = existing(simulation);
    const jobs = scene.tiles + count;
    scene.photograph(ensemble, count, electrons, seed, (done) => report(done / jobs));
    const numbers = Array.from({ length: count }, (_, i) => i);
    return {
      patterns: numbers.map((i) => scene.pattern(i)),
      photographs: numbers.map((i) => scene.photo(i)),
      dark: scene.dark,
    };
  },

  /** @param {Float32Array} light */
  picture: (light) => existing(simulation).picture(light),

  /** @param {{ x: number, y: number, width: number, height: number }} rectangle of pixels */
  functions: ({ x, y, width, height }) => existing(simulation).functions(x, y, width, height),

  /** @param {{ tile: TileFunctions, window: number }} recovered */
  tileError: ({ tile: { x, y, width, height, values }, window }) =>
    existing(simulation).tileError(x, y, width, height, window, values),

  /** @param {TransportGeometry} geometry */
  async analyse({ width, height, lightWidth, lightHeight, window, correspondence }) {
    const { TransportAnalysis } = await load();
    analysis?.free();
    analysis = new TransportAnalysis(
      width,
      height,
      lightWidth,
      lightHeight,
      window,
      correspondence,
      BAND_CELLS,
    );
  },

  /** @param {TileFunctions} tile */
  addTile: ({ x, y, width, height, values }) =>
    existing(analysis).addTile(x, y, width, height, values),

  band: () => ({ cells: BAND_CELLS, values: existing(analysis).band }),

  singularValues() {
    const done = existing(analysis);
    analysis = undefined;
    const [width = 0, height = 0] = done.block;
    return { width, height, values: done.singularValues() };
  },
};

addEventListener('message', async ({ data: { id, method, args } }) => {
  try {
    const run = /** @type {(args: unknown, report: Report) => unknown} */ (
      methods[/** @type {keyof typeof methods} */ (method)]
    );
    const result = await run(args, (progress) => postMessage({ id, progress }));
    postMessage({ id, result });
  } catch (error) {
    const { message, code } = /** @type {Error & { code?: string }} */ (error);
    postMessage({ id, error: message, code });
  }
});
