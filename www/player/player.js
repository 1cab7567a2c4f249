/**
 * The pattern player: shows the pictures of a sequence one after the other, pixel by pixel, and nothing else.
 * `ltm-export patterns` writes it into the folder of a sequence, with the sequence in the page, so that it needs no server
 * and no network. `ltm-export shoot` serves it, says which picture comes next, and is told when the display shows it.
 */

/** @typedef {{ layout: { display: { width: number, height: number } }, pictures: { picture: string, role: string }[] }} Sequence */

/** @typedef {{ picture: number, photograph: number }} ShownPicture */
/**
 * @typedef {{ run: number, sequence: string, version: number, show: ShownPicture | null, message: string, histogram: number[][], question: string | null,
 *   finished: boolean }} PageState
 */

const NEXT_KEYS = new Set([' ', 'ArrowRight', 'ArrowDown', 'PageDown', 'Enter']);
const BACK_KEYS = new Set(['ArrowLeft', 'ArrowUp', 'PageUp', 'Backspace']);
/** Time after which a server that does not answer is asked again, in milliseconds. */
const RETRY_INTERVAL = 1000;
const CHANNEL_COLOURS = ['#d33', '#2a2', '#36d'];

/**
 * @template {HTMLElement} T
 * @param {string} id
 * @param {new () => T} type
 * @returns {T}
 */
function element(id, type) {
  const found = document.getElementById(id);
  if (!(found instanceof type)) throw new Error(`the page has no ${id}`);
  return found;
}

/** @type {Sequence} */
const sequence = JSON.parse(sequenceText());
const { display } = sequence.layout;
const last = sequence.pictures.length - 1;

/** Where the number of the picture is kept, for this sequence in this folder. */
const POSITION_KEY = `pattern-player ${hash(sequenceText())} ${location.pathname}`;

/** A window or this page, filled by one picture. */
class Stage {
  /** @param {Window} view */
  constructor(view) {
    this.view = view;
    this.wanted = '';
    const { document } = view;
    this.root = document.createElement('div');
    this.root.style.cssText =
      'position:fixed;inset:0;background:#000;overflow:hidden;cursor:none;z-index:1';
    document.body.append(this.root);
  }

  /** Why the pictures cannot be shown pixel by pixel; undefined if they can. */
  get problem() {
    const { innerWidth, innerHeight, devicePixelRatio } = this.view;
    const [width, height] = [innerWidth, innerHeight].map((side) =>
      Math.round(side * devicePixelRatio),
    );
    if (width === display.width && height === display.height) return undefined;
    return (
      `The pictures have ${display.width} × ${display.height} pixels, but the window has ${width} × ${height}. ` +
      'Set the display to its own resolution, its scale and the browser’s zoom to 100 %, and show the window in full ' +
      `screen; or write pictures of this size with ltm-export patterns --screen ${width}x${height}.`
    );
  }

  /**
   * Shows a picture once it is decoded, unless another one is wanted by then.
   *
   * @param {string} url
   */
  async show(url) {
    this.wanted = url;
    const [width, height] = [display.width, display.height].map(
      (side) => side / this.view.devicePixelRatio,
    );
    const image = this.view.document.createElement('img');
    image.alt = '';
    image.style.cssText = `position:absolute;left:0;top:0;width:${width}px;height:${height}px;image-rendering:pixelated`;
    image.src = url;
    await image.decode();
    if (this.wanted === url) this.root.replaceChildren(image);
  }

  close() {
    this.root.remove();
    if (this.view !== window) this.view.close();
  }
}

class Player {
  /** @type {Stage | undefined} */
  stage;
  position = 0;
  /** When the next picture follows by time, on the clock of `performance.now`. @type {number | undefined} */
  due;
  /** @type {number | undefined} */
  timer;
  /** @type {WakeLockSentinel | undefined} */
  wakeLock;
  /** Pictures that the browser keeps. @type {HTMLImageElement[]} */
  preloaded = [];
  /** Another one than the operator says which picture is next. */
  isRemote = false;
  /** Is told that the stage shows the picture at `position`, or nothing. @type {(isShown: boolean) => void} */
  onShown = () => {};

  constructor() {
    this.position = Math.min(Math.max(Number.parseInt(readPosition() ?? '', 10) || 0, 0), last);
    element('count', HTMLElement).textContent = String(last + 1);
    element('total', HTMLElement).textContent = String(last + 1);
    element('size', HTMLElement).textContent = `${display.width} × ${display.height}`;
    element('here', HTMLElement).onclick = () => this.openHere();
    element('there', HTMLElement).onclick = () => this.openThere();
    element('next', HTMLElement).onclick = () => this.move(1);
    element('back', HTMLElement).onclick = () => this.move(-1);
    element('restart', HTMLElement).onclick = () => this.move(-this.position);
    const pace = element('pace', HTMLSelectElement);
    pace.onchange = () => {
      element('interval-label', HTMLElement).hidden = pace.value !== 'time';
      this.due = undefined;
      this.schedule();
    };
    document.addEventListener('keydown', (event) => {
      const isControl =
        event.target instanceof HTMLElement && event.target.closest('button, select, input');
      if (this.stage && this.stage.view !== window && !isControl) this.onKey(event);
    });
    document.addEventListener('fullscreenchange', () => {
      if (!document.fullscreenElement && this.stage?.view === window) this.closeStage();
    });
    this.update();
  }

  async openHere() {
    const root = document.documentElement;
    try {
      await root.requestFullscreen({ navigationUI: 'hide' });
    } catch {
      report('The browser allows no full screen. Press F11, or use another browser.');
      return;
    }
    await afterResize(window);
    this.use(new Stage(window));
  }

  /** Opens a window, on the screen whose size the pictures have if the browser tells. */
  async openThere() {
    this.closeStage();
    const place = await otherScreen();
    const view = window.open('about:blank', 'pattern-player', `popup,${place.features}`);
    if (!view) {
      report('The browser blocked the window. Allow windows of this page, and try again.');
      return;
    }
    view.document.title = 'Patterns';
    view.document.documentElement.lang = 'en';
    const stage = new Stage(view);
    view.addEventListener('pagehide', () => {
      if (this.stage === stage) this.closeStage();
    });
    view.addEventListener('resize', () => this.check());
    const button = view.document.createElement('button');
    button.textContent = 'Move this window to the screen of the patterns, then click here';
    button.style.cssText = 'position:fixed;inset:0;margin:auto;font:1.5rem system-ui;z-index:2';
    button.onclick = async () => {
      try {
        await view.document.documentElement.requestFullscreen({ navigationUI: 'hide' });
      } catch {
        report('The browser allows no full screen. Press F11 in the window of the patterns.');
      }
      await afterResize(view);
      button.remove();
      this.use(stage);
    };
    view.document.body.append(button);
    button.focus();
  }

  /** @param {Stage} stage */
  use(stage) {
    this.stage?.close();
    this.stage = stage;
    if (!this.check()) return;
    stage.view.addEventListener('keydown', this.onKey);
    stage.root.addEventListener('click', () => this.move(1));
    this.keepAwake();
    this.update();
  }

  /** Whether the stage shows pictures pixel by pixel; if not, it is closed with the reason. */
  check() {
    const problem = this.stage?.problem;
    if (problem) {
      this.closeStage();
      report(problem);
    } else if (this.stage) {
      report('');
    }
    return !problem;
  }

  closeStage() {
    this.clearTimer();
    this.due = undefined;
    const { stage } = this;
    this.stage = undefined;
    stage?.view.removeEventListener('keydown', this.onKey);
    stage?.close();
    if (document.fullscreenElement) document.exitFullscreen().catch(() => {});
    this.wakeLock?.release().catch(() => {});
    this.wakeLock = undefined;
    if (stage) this.onShown(false);
  }

  /** @param {KeyboardEvent} event */
  onKey = (event) => {
    // A key that is held down is one step.
    if (event.repeat || event.ctrlKey || event.altKey || event.metaKey) return;
    const step = NEXT_KEYS.has(event.key) ? 1 : BACK_KEYS.has(event.key) ? -1 : 0;
    if (step === 0) return;
    event.preventDefault();
    this.move(step);
  };

  /** By hand. @param {number} step */
  move(step) {
    if (this.isRemote) return;
    this.due = undefined;
    this.go(step);
  }

  /** @param {number} step */
  go(step) {
    const to = this.position + step;
    if (to < 0) return;
    if (to > last) {
      this.closeStage();
      savePosition(0);
      report('That was the last picture.');
      return;
    }
    this.position = to;
    savePosition(to);
    this.update();
  }

  update() {
    const { picture, role } = /** @type {Sequence['pictures'][number]} */ (
      sequence.pictures[this.position]
    );
    element('number', HTMLElement).textContent = String(this.position + 1);
    element('name', HTMLElement).textContent = `${picture} (${role})`;
    element('thumbnail', HTMLImageElement).src = picture;
    this.preloaded = sequence.pictures.slice(this.position + 1, this.position + 4).map((next) => {
      const image = new Image();
      image.src = next.picture;
      return image;
    });
    this.show(picture);
  }

  /** @param {string} picture */
  async show(picture) {
    this.clearTimer();
    const { stage } = this;
    if (!stage) return;
    const url = new URL(picture, location.href).href;
    try {
      await stage.show(url);
    } catch {
      if (stage !== this.stage || stage.wanted !== url) return;
      this.closeStage();
      report(`${picture} cannot be read. Keep this page in the folder of its pictures.`);
      return;
    }
    if (stage !== this.stage || stage.wanted !== url) return;
    this.onShown(true);
    this.schedule();
  }

  /** By time, pictures follow at multiples of the interval, however long they take to load: a camera keeps its own time. */
  schedule() {
    this.clearTimer();
    const isPaced = element('pace', HTMLSelectElement).value === 'time';
    if (!this.stage || this.isRemote || !isPaced) return;
    const seconds = Math.max(element('interval', HTMLInputElement).valueAsNumber || 3, 0.2);
    const due = this.due ?? performance.now() + 1000 * seconds;
    this.due = due;
    // By the window that is shown: others have slower timers.
    this.timer = this.stage.view.setTimeout(() => {
      this.due = due + 1000 * seconds;
      this.go(1);
    }, due - performance.now());
  }

  clearTimer() {
    this.stage?.view.clearTimeout(this.timer);
  }

  async keepAwake() {
    try {
      this.wakeLock = await navigator.wakeLock.request('screen');
    } catch {
      // Not in every browser, and not from files: the page asks to switch off the screen saver.
    }
  }
}

/** The player under the control of `ltm-export shoot`, which serves the page and photographs what it shows. */
class RemoteControl {
  /** The picture that the server wants. @type {ShownPicture | undefined} */
  wanted;
  /** The server's run: another one counts anew. */
  run = 0;
  /** The server's sequence, once known, and whether its photographs are all taken. @type {string | undefined} */
  sequence;
  isFinished = false;
  /** Tells this page from others of the same server. */
  page = crypto.randomUUID();

  /** @param {Player} player */
  constructor(player) {
    this.player = player;
    player.isRemote = true;
    player.onShown = (isShown) => this.confirm(isShown);
    for (const part of document.querySelectorAll('.by-hand')) part.setAttribute('hidden', '');
    element('session', HTMLElement).hidden = false;
    element('again', HTMLElement).onclick = () => this.answer(true);
    element('go-on', HTMLElement).onclick = () => this.answer(false);
    addEventListener('pagehide', () => {
      navigator.sendBeacon('shown', jsonBlob({ page: this.page, shown: null }));
    });
    this.follow();
  }

  /** Shows what the server wants, until the session ends. */
  async follow() {
    let version = 0;
    for (;;) {
      /** @type {PageState} */
      let state;
      try {
        const response = await fetch(`state/${version}`);
        if (!response.ok) throw new Error(response.statusText);
        state = await response.json();
      } catch {
        if (!this.isFinished) {
          tell('The program that photographs does not answer. Run it again: the session goes on.');
        }
        await new Promise((resolve) => setTimeout(resolve, RETRY_INTERVAL));
        version = 0;
        continue;
      }
      version = state.version;
      this.sequence ??= state.sequence;
      // The pictures in this page are of another session.
      if (state.sequence !== this.sequence) location.reload();
      this.isFinished = state.finished;
      this.update(state);
    }
  }

  /** @param {PageState} state */
  update({ run, show, message, histogram, question, finished }) {
    if (run !== this.run) this.wanted = undefined;
    this.run = run;
    tell(message);
    drawHistogram(histogram);
    const asked = element('question', HTMLElement);
    asked.hidden = question === null;
    const text = asked.querySelector('span');
    if (text) text.textContent = question;
    if (finished) {
      this.player.closeStage();
      report('');
      return;
    }
    const isNew = show?.photograph !== this.wanted?.photograph;
    if (!show || !isNew) return;
    this.wanted = show;
    this.player.position = show.picture;
    this.player.update();
  }

  /** Tells the server what the display shows, once it does. @param {boolean} isShown */
  async confirm(isShown) {
    const { player, wanted } = this;
    const { stage } = player;
    if (isShown && stage) {
      // The picture is decoded; two frames later it is on the screen.
      for (let frame = 0; frame < 2; frame += 1) {
        await new Promise((resolve) => stage.view.requestAnimationFrame(resolve));
      }
      if (player.stage !== stage || wanted !== this.wanted) return;
    }
    await post('shown', { page: this.page, shown: isShown && wanted ? wanted : null });
  }

  /** @param {boolean} again */
  async answer(again) {
    element('question', HTMLElement).hidden = true;
    await post('answer', { again });
  }
}

function sequenceText() {
  return element('sequence', HTMLScriptElement).textContent ?? '';
}

/** A number that differs between texts. @param {string} text */
function hash(text) {
  let value = 0;
  for (const character of text) value = (31 * value + (character.codePointAt(0) ?? 0)) | 0;
  return value;
}

/** @param {string} text */
function report(text) {
  element('problem', HTMLElement).textContent = text;
}

function readPosition() {
  try {
    return localStorage.getItem(POSITION_KEY);
  } catch {
    return null;
  }
}

/** @param {number} position */
function savePosition(position) {
  try {
    localStorage.setItem(POSITION_KEY, String(position));
  } catch {
    // Without storage, a reload starts again.
  }
}

/** Full screen takes a moment to change the size. @param {Window} view */
function afterResize(view) {
  return new Promise((resolve) => {
    setTimeout(() => view.requestAnimationFrame(() => resolve(undefined)), 300);
  });
}

/** Where a window for the patterns opens. */
async function otherScreen() {
  const features = `width=${Math.round(screen.width / 2)},height=${Math.round(screen.height / 2)}`;
  if (!('getScreenDetails' in window)) return { features };
  try {
    /** @type {{ screens: (Screen & { left: number, top: number, devicePixelRatio: number })[], currentScreen: Screen }} */
    const details = await /** @type {any} */ (window).getScreenDetails();
    const others = details.screens.filter((other) => other !== details.currentScreen);
    const fits = (/** @type {(typeof others)[number]} */ other) =>
      Math.round(other.width * other.devicePixelRatio) === display.width &&
      Math.round(other.height * other.devicePixelRatio) === display.height;
    const chosen = others.find(fits) ?? others[0];
    if (!chosen) return { features };
    const { left, top, width, height } = chosen;
    return { features: `left=${left},top=${top},width=${width},height=${height}` };
  } catch {
    return { features };
  }
}

/** @param {unknown} value */
function jsonBlob(value) {
  return new Blob([JSON.stringify(value)], { type: 'application/json' });
}

/** @param {string} path @param {unknown} value */
async function post(path, value) {
  try {
    await fetch(path, { method: 'POST', body: jsonBlob(value) });
  } catch {
    // The server is gone, which the page says already.
  }
}

/** @param {string} text */
function tell(text) {
  const message = element('message', HTMLElement);
  if (message.textContent !== text) message.textContent = text;
}

/** One line for each channel, on a logarithmic scale. @param {number[][]} channels */
function drawHistogram(channels) {
  const most = Math.max(...channels.flat(), 1);
  const lines = channels.map((bins, c) => {
    const points = bins.map((count, i) => {
      const height = (32 * Math.log1p(count)) / Math.log1p(most);
      return `${((i + 0.5) * 64) / bins.length},${32 - height}`;
    });
    const line = document.createElementNS('http://www.w3.org/2000/svg', 'polyline');
    line.setAttribute('points', points.join(' '));
    line.setAttribute('stroke', CHANNEL_COLOURS[c] ?? '#888');
    return line;
  });
  document.getElementById('histogram')?.replaceChildren(...lines);
}

const player = new Player();
if ('remote' in document.documentElement.dataset) new RemoteControl(player);
