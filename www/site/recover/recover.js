/** The page "Recover": recovers a relightable photograph, and shows its pictures and its light transport. */

import { CameraCapture } from './camera/camera-capture.js';
import { Job } from './job.js';
import { formatNumber, onLanguageChange, startLanguages, t } from './language.js';
import { OwnCapture } from './own-capture.js';
import { recoverModule } from './recovery.js';
import { saveFile } from './save-file.js';
import { SimulatedObject, SWEEP_PATTERNS } from './simulated.js';
import { SnrPlot } from './snr-plot.js';
import { Structure } from './structure.js';
import { Viewer } from './viewer.js';

/** @typedef {import('./types.js').Result} Result */
/** @typedef {import('./types.js').ReportStage} ReportStage */
/** @typedef {{ signal: AbortSignal, report: ReportStage }} JobOptions */

const byId = (/** @type {string} */ id) => /** @type {HTMLElement} */ (document.getElementById(id));

const source = byId('source');
const frame = byId('element');
/** @type {Result | undefined} */
let shown;
/** Whether a change of the settings starts a recovery: after the visitor's first. */
let isLive = false;

await startLanguages(byId('recover'));
const job = new Job();
const viewer = new Viewer();
const structure = new Structure();
const plot = new SnrPlot();
const simulated = new SimulatedObject({
  onChange: () => {
    if (isLive) recoverSimulated();
  },
});
const own = new OwnCapture({
  onOpen: (open) =>
    job.run(async () => {
      await own.choose(await open());
      return byId('chosen').textContent ?? '';
    }),
  onChange: updateButtons,
});
const camera = new CameraCapture({
  run: (work) => job.run(work),
  onChange: updateButtons,
  onCapture: recoverPhotographs,
});

source.addEventListener('change', () => {
  job.cancel();
  showSource();
});
byId('start').addEventListener('click', () => {
  if (chosenSource() === 'simulated') recoverSimulated();
  else recoverPhotographs();
});
byId('sweep').addEventListener('click', sweep);
byId('save').addEventListener('click', save);
onLanguageChange(showFacts);
showSource();

/** @returns {'simulated' | 'own' | 'camera'} */
function chosenSource() {
  const checked = /** @type {HTMLInputElement | null} */ (source.querySelector(':checked'));
  return /** @type {'simulated' | 'own' | 'camera'} */ (checked?.value ?? 'simulated');
}

function showSource() {
  const chosen = chosenSource();
  for (const name of ['simulated', 'own', 'camera']) byId(name).hidden = name !== chosen;
  if (chosen !== 'camera') camera.close();
  // A drop can be read only while its event is handled: the scripts must be there before.
  if (chosen !== 'simulated') void recoverModule();
  updateButtons();
}

function updateButtons() {
  const chosen = chosenSource();
  const canStart = { simulated: true, own: own.isChosen, camera: camera.hasCapture };
  job.enable({ start: canStart[chosen], sweep: chosen === 'simulated' });
}

function recoverSimulated() {
  isLive = true;
  void recover(solveSimulated);
}

/** Runs a recovery, without an analysis beside it. @param {(options: JobOptions) => Promise<string>} work */
async function recover(work) {
  structure.show(undefined);
  await job.run(work);
  if (!job.isRunning) structure.show(shown);
}

/** @param {JobOptions} options */
async function solveSimulated(options) {
  const settings = simulated.settings();
  const { key, names } = simulated.line(settings);
  const { result, snr } = await simulated.recover(settings, options);
  show(result);
  plot.add(key, names, settings.patterns, snr);
  return t('done.simulated', {
    patterns: settings.patterns,
    seconds: formatNumber(result.recovered.seconds, 1),
    snr: formatNumber(snr, 1),
  });
}

function sweep() {
  isLive = true;
  void recover(async (options) => {
    let done = '';
    for (const patterns of SWEEP_PATTERNS) {
      options.signal.throwIfAborted();
      simulated.setPatterns(patterns);
      done = await solveSimulated(options);
    }
    return done;
  });
}

function recoverPhotographs() {
  const photographs = chosenSource() === 'camera' ? camera : own;
  void recover(async (options) => {
    const result = await photographs.recover(options);
    show(result);
    const { shotsUsed, seconds } = result.recovered;
    return t('done.own', { patterns: shotsUsed.length, seconds: formatNumber(seconds, 1) });
  });
}

/** Shows a result in place of the last. @param {Result} result */
function show(result) {
  const last = shown;
  shown = result;
  void viewer.show(result);
  frame.hidden = result.truth !== undefined;
  frame.replaceChildren(...(result.truth ? [] : [relightable(result)]));
  showFacts();
  last?.recovered.free();
  simulated.keepOnly(result.truth);
}

/** @param {Result} result */
function relightable({ recovered, name }) {
  const element = document.createElement('relightable-photo');
  element.setAttribute('alt', name);
  element.setAttribute('light', 'torch');
  element.toggleAttribute('controls', true);
  element.photograph = recovered;
  return element;
}

function showFacts() {
  if (!shown) return;
  const { recovered, facts } = shown;
  const { width, height, lightWidth, lightHeight, window, rank, expectedSnr } = recovered;
  const all = [
    t('fact.size', { width, height, lightWidth, lightHeight }),
    ...facts(),
    t('fact.window', { window }),
    ...(rank === undefined ? [] : [t('fact.rank', { rank })]),
    ...(expectedSnr === undefined
      ? []
      : [t('fact.expected', { snr: formatNumber(expectedSnr, 1) })]),
  ];
  byId('facts').replaceChildren(...all.map(listItem));
  byId('warnings').replaceChildren(...recovered.warnings.map(({ message }) => listItem(message)));
}

/** @param {string} text */
function listItem(text) {
  const item = document.createElement('li');
  item.textContent = text;
  return item;
}

function save() {
  if (!shown) return;
  const { recovered, name } = shown;
  void job.run(async ({ signal, report }) => {
    const file = await recovered.toBlob(undefined, {
      signal,
      onProgress: ({ fraction, secondsLeft }) => report('job.encoding', fraction, secondsLeft),
    });
    saveFile(file, `${name}.ltm`);
    return t('done.file', { size: formatNumber(file.size / 1e6, 2) });
  });
}
