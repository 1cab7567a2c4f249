/** One job at a time: its progress, its end, and its faults. Its place on the page stays when it ends. */

import { onLanguageChange, t } from './language.js';
import { PageFault } from './page-fault.js';

/** Shortest time between two messages for screen readers. */
const ANNOUNCEMENT_INTERVAL_MS = 5000;

/** @typedef {import('./types.js').ReportStage} ReportStage */

export class Job {
  #buttons = {
    start: /** @type {HTMLButtonElement} */ (document.getElementById('start')),
    sweep: /** @type {HTMLButtonElement} */ (document.getElementById('sweep')),
    cancel: /** @type {HTMLButtonElement} */ (document.getElementById('cancel')),
  };
  #page = /** @type {HTMLElement} */ (document.getElementById('recover'));
  #bar = /** @type {HTMLProgressElement} */ (document.querySelector('#job progress'));
  #text = /** @type {HTMLElement} */ (document.getElementById('job-text'));
  #announcement = /** @type {HTMLElement} */ (document.getElementById('announcement'));
  #fault = /** @type {HTMLElement} */ (document.getElementById('fault'));
  /** @type {AbortController | undefined} */
  #running;
  #announcedAt = 0;

  constructor() {
    this.#buttons.cancel.addEventListener('click', () => {
      this.cancel();
      this.#tell(t('job.cancelled'));
    });
    document.addEventListener('visibilitychange', () => {
      if (this.#running && document.hidden) this.#tell(t('job.hidden'));
    });
    onLanguageChange(() => {
      if (!this.#running) this.#tell('');
    });
  }

  get isRunning() {
    return this.#running !== undefined;
  }

  /** Which buttons can be pressed while no job runs. @param {{ start: boolean, sweep: boolean }} enabled */
  enable({ start, sweep }) {
    this.#buttons.start.disabled = !start;
    this.#buttons.sweep.hidden = !sweep;
    this.#buttons.sweep.disabled = !sweep;
  }

  cancel() {
    this.#running?.abort();
  }

  /** Tells it to screen readers. @param {string} message */
  announce(message) {
    this.#announcement.textContent = message;
  }

  /**
   * Runs a job, after the end of the one before. Faults are shown.
   *
   * @param {(options: { signal: AbortSignal, report: ReportStage }) => Promise<string>} work returns what to announce
   */
  async run(work) {
    this.cancel();
    const controller = new AbortController();
    this.#running = controller;
    this.#announcedAt = 0;
    this.#fault.replaceChildren();
    this.#bar.removeAttribute('value');
    this.#text.textContent = '';
    this.#showRunning(true);
    try {
      const done = await work({
        signal: controller.signal,
        report: (key, share, secondsLeft) => {
          if (this.#running === controller) this.#report(key, share, secondsLeft);
        },
      });
      if (this.#running === controller) this.#tell(done);
    } catch (error) {
      if (!controller.signal.aborted) {
        this.#text.textContent = '';
        this.#showFault(/** @type {Error} */ (error));
      }
    } finally {
      // A later job may have begun.
      if (this.#running === controller) {
        this.#running = undefined;
        this.#showRunning(false);
      }
    }
  }

  /** @param {string} message for eyes and screen readers */
  #tell(message) {
    this.#text.textContent = message;
    this.announce(message);
  }

  /** Shows a fault that ended a job, with its code. @param {Error & { code?: string }} error */
  #showFault(error) {
    const { message, code } = error;
    const text = document.createElement('p');
    if (error instanceof PageFault) {
      text.textContent = t(`fault.${code}`, error.values);
    } else {
      // The library's messages are English.
      text.lang = 'en';
      text.textContent = message;
    }
    const shown = [text];
    if (code) {
      const codeText = document.createElement('p');
      codeText.className = 'code-name';
      codeText.textContent = t('fault.code', { code });
      shown.push(codeText);
    }
    this.#fault.replaceChildren(...shown);
  }

  /** @type {ReportStage} */
  #report(key, share, secondsLeft) {
    this.#bar.value = share;
    // What the page says of hidden tabs stays.
    if (document.hidden) return;
    const left =
      secondsLeft === undefined ? [] : [t('job.left', { seconds: Math.ceil(secondsLeft) })];
    const message = [t(key), ...left].join(' · ');
    this.#text.textContent = message;
    if (performance.now() - this.#announcedAt > ANNOUNCEMENT_INTERVAL_MS) {
      this.#announcedAt = performance.now();
      this.announce(message);
    }
  }

  /** @param {boolean} isRunning */
  #showRunning(isRunning) {
    const { cancel, start } = this.#buttons;
    // The style hides a button that cannot be pressed.
    if (!isRunning && document.activeElement === cancel) start.focus();
    this.#page.toggleAttribute('data-running', isRunning);
  }
}
