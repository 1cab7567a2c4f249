/** Recovery of the visitor's own capture, from a folder or a zip file. */

import { recoverCapture } from './capture-recovery.js';
import { onLanguageChange, t } from './language.js';
import { recoverModule, recoverSettings } from './recovery.js';

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

  /** Shows name and size of the chosen capture, and the memory and time that its recovery takes. */
  async #describe() {
    const capture = this.#capture;
    if (!capture) return;
    const { name, files } = capture;
    const said = [t('own.files', { name, files: files.size })];
    const { estimateRecovery, recoverySize } = await recoverModule();
    // The recovery reports a manifest without a size.
    const size = await recoverySize({ folder: files });
    if (size) {
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
