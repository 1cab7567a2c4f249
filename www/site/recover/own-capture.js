/** Recovery of the visitor's own capture, from a folder or a zip file. */

import { recoverCapture } from './capture-recovery.js';
import { onLanguageChange, t } from './language.js';
import { recoverModule, recoverSettings } from './recovery.js';

/** Of the shots of a folder so many are held out. */
const HELD_OUT_SHARE = 0.1;

/**
 * @typedef {import('./types.js').Result} Result
 * @typedef {import('./types.js').ReportStage} ReportStage
 * @typedef {import('./capture-recovery.js').Capture} Capture
 */

export class OwnCapture {
  #form = /** @type {HTMLFormElement} */ (document.getElementById('own'));
  #drop = /** @type {HTMLElement} */ (document.getElementById('drop'));
  #chosen = /** @type {HTMLElement} */ (document.getElementById('chosen'));
  /** @type {Capture | undefined} */
  #capture;
  #onChange;

  /** @param {{ onOpen: (open: () => Promise<Capture>) => void, onChange: () => void }} options */
  constructor({ onOpen, onChange }) {
    this.#onChange = onChange;
    const open = (/** @type {string} */ name, /** @type {any} */ source) =>
      onOpen(async () => ({
        name,
        files: await (await recoverModule()).openCaptureFolder(source),
      }));
    this.#form.addEventListener('submit', (event) => event.preventDefault());
    this.#form.addEventListener('change', ({ target }) => {
      if (target instanceof HTMLSelectElement) void this.#describe();
    });
    const [folder, zip] = /** @type {HTMLInputElement[]} */ ([
      ...this.#form.querySelectorAll('input[type=file]'),
    ]);
    folder?.addEventListener('click', async (event) => {
      if (!('showDirectoryPicker' in window)) return;
      // The input would ask for permission to upload.
      event.preventDefault();
      const picker = /** @type {{ showDirectoryPicker(): Promise<FileSystemDirectoryHandle> }} */ (
        /** @type {unknown} */ (window)
      );
      const chosen = await picker.showDirectoryPicker().catch(() => undefined);
      if (chosen) open(chosen.name, chosen);
    });
    folder?.addEventListener('change', () => {
      const files = [...(folder.files ?? [])];
      // So that the same folder can be chosen again after a change.
      folder.value = '';
      const [first] = files;
      if (first) open(first.webkitRelativePath.split('/')[0] ?? '', files);
    });
    zip?.addEventListener('change', () => {
      const [file] = zip.files ?? [];
      zip.value = '';
      if (file) open(file.name, file);
    });
    this.#acceptDrops(open);
    onLanguageChange(() => void this.#describe());
  }

  get isChosen() {
    return this.#capture !== undefined;
  }

  /** @param {Capture} capture */
  async choose(capture) {
    this.#capture = capture;
    await this.#describe();
    this.#onChange();
  }

  /**
   * @param {{ signal: AbortSignal, report: ReportStage }} options
   * @returns {Promise<Result>}
   */
  async recover({ signal, report }) {
    if (!this.#capture) throw new Error('no capture was chosen');
    return recoverCapture(this.#capture, this.#settings(), { signal, report });
  }

  #settings() {
    const value = (/** @type {string} */ name) =>
      /** @type {HTMLSelectElement} */ (this.#form.elements.namedItem(name)).value;
    return { method: value('method'), window: value('window') };
  }

  /** Says what was chosen, and what its recovery takes. */
  async #describe() {
    const capture = this.#capture;
    if (!capture) return;
    const { name, files } = capture;
    const said = [t('own.files', { name, files: files.size })];
    const size = await manifestSize(files);
    if (size) {
      const { estimateRecovery } = await recoverModule();
      const estimate = estimateRecovery(size, recoverSettings(this.#settings()));
      said.push(
        t('fact.size', { ...size }),
        t('own.estimate', {
          memory: Math.ceil(estimate.memoryBytes / 1e6),
          seconds: Math.ceil(estimate.seconds),
        }),
      );
    }
    if (capture === this.#capture) this.#chosen.textContent = said.join(' · ');
  }

  /** @param {(name: string, source: DataTransfer) => void} open */
  #acceptDrops(open) {
    const mark = (/** @type {boolean} */ isOver) => this.#drop.toggleAttribute('data-over', isOver);
    this.#drop.addEventListener('dragover', (event) => {
      event.preventDefault();
      mark(true);
    });
    this.#drop.addEventListener('dragleave', () => mark(false));
    this.#drop.addEventListener('drop', (event) => {
      event.preventDefault();
      mark(false);
      const { dataTransfer } = event;
      if (dataTransfer?.items[0]) open(dataTransfer.files[0]?.name ?? '', dataTransfer);
    });
  }
}

/** The size of the recovery that a manifest describes; nothing if it cannot be read, which the recovery reports. @param {ReadonlyMap<string, Blob>} files */
async function manifestSize(files) {
  try {
    const { camera, light, shots } = JSON.parse((await files.get('capture.json')?.text()) ?? '');
    return {
      width: camera.width,
      height: camera.height,
      lightWidth: light.width,
      lightHeight: light.height,
      photographs: Math.ceil(shots.length * (1 - HELD_OUT_SHARE)),
    };
  } catch {
    return undefined;
  }
}
