/** What is inside the element's shadow: the picture, a progress bar, a message. Holds no state that
 * is not on the screen. */

/** Fallbacks stand at each use, so that a page need set none of these properties. */
const STYLE = `
:host {
  display: block;
  position: relative;
  overflow: hidden;
  background: var(--relightable-photo-background, #131211);
  color: var(--relightable-photo-color, #f2efe9);
  font: 0.875rem/1.45 system-ui, sans-serif;
}
:host([hidden]) { display: none; }
.picture { position: relative; aspect-ratio: var(--relightable-photo-aspect, 1); }
.picture.filled { aspect-ratio: auto; }
.picture.torch { touch-action: pan-y; cursor: crosshair; user-select: none; -webkit-user-select: none; }
.picture:focus { outline: none; }
.picture:focus-visible::after {
  content: "";
  position: absolute;
  inset: 0;
  border: 3px solid var(--relightable-photo-focus, #ffc864);
  box-shadow: inset 0 0 0 2px #000;
  pointer-events: none;
}
canvas { display: block; width: 100%; height: auto; }
.progress {
  position: absolute;
  inset: auto 0 0 0;
  height: 4px;
  background: rgb(255 255 255 / 0.18);
  overflow: hidden;
}
.bar {
  height: 100%;
  width: 100%;
  background: var(--relightable-photo-accent, #ffc864);
  transform-origin: left;
  transform: scaleX(0);
}
.progress.unknown .bar { width: 30%; transform: none; animation: seek 1.4s ease-in-out infinite alternate; }
@keyframes seek { from { transform: translateX(0); } to { transform: translateX(233%); } }
@media (prefers-reduced-motion: reduce) { .progress.unknown .bar { animation: none; width: 100%; opacity: 0.5; } }
.message {
  position: absolute;
  inset: auto 0 0 0;
  padding: 0.9em 1.1em;
  background: rgb(20 16 14 / 0.92);
  color: #f7ece2;
  border-top: 2px solid #e06c4f;
  overflow-wrap: anywhere;
}
.hint { position: absolute; width: 1px; height: 1px; overflow: hidden; clip-path: inset(50%); white-space: nowrap; }
[hidden] { display: none !important; }
`;

let sheet: CSSStyleSheet | undefined;

/** See the module. */
export class View {
  /** The picture's box; takes the pointer and the keyboard. */
  readonly picture: HTMLElement;
  readonly #progress: HTMLElement;
  readonly #bar: HTMLElement;
  readonly #message: HTMLElement;

  constructor(root: ShadowRoot) {
    // A constructed sheet needs no 'unsafe-inline' in the page's content security policy.
    if (!sheet) {
      sheet = new CSSStyleSheet();
      sheet.replaceSync(STYLE);
    }
    root.adoptedStyleSheets = [sheet];
    this.picture = box('picture', 'picture');
    this.#progress = box('progress', 'progress');
    this.#progress.setAttribute('role', 'progressbar');
    this.#progress.setAttribute('aria-label', 'Loading the photograph');
    this.#bar = box('bar');
    this.#progress.append(this.#bar);
    this.#progress.hidden = true;
    this.#message = box('message', 'message');
    this.#message.setAttribute('role', 'alert');
    this.#message.hidden = true;
    const hint = box('hint');
    hint.id = 'hint';
    hint.textContent = 'The arrow keys move the torch.';
    root.append(this.picture, hint, this.#progress, this.#message);
  }

  /**
   * Names the picture for those who cannot see it, and says whether it holds a torch. An empty text
   * marks it as decoration, which what holds a torch is not: it takes the keyboard.
   */
  describe(alt: string | null, torch: boolean): void {
    this.picture.setAttribute('role', alt === '' && !torch ? 'presentation' : 'img');
    if (alt) this.picture.setAttribute('aria-label', alt);
    else this.picture.removeAttribute('aria-label');
    this.picture.classList.toggle('torch', torch);
    if (torch) {
      this.picture.tabIndex = 0;
      this.picture.setAttribute('aria-describedby', 'hint');
    } else {
      this.picture.removeAttribute('tabindex');
      this.picture.removeAttribute('aria-describedby');
    }
  }

  /** Shows a canvas in place of the last one. */
  show(canvas: HTMLCanvasElement): void {
    this.picture.classList.add('filled');
    canvas.setAttribute('part', 'canvas');
    this.picture.replaceChildren(canvas);
  }

  /** Takes the picture away. */
  clear(): void {
    this.picture.classList.remove('filled');
    this.picture.replaceChildren();
    this.progress(null);
    this.message(null);
  }

  /** Shows how far a load has come, from 0 to 1, `NaN` where that is not known; `null` hides it. */
  progress(fraction: number | null): void {
    this.#progress.hidden = fraction === null;
    if (fraction === null) return;
    const known = Number.isFinite(fraction);
    this.#progress.classList.toggle('unknown', !known);
    if (known) {
      this.#bar.style.transform = `scaleX(${fraction})`;
      this.#progress.setAttribute('aria-valuenow', String(Math.round(fraction * 100)));
    } else {
      this.#bar.style.transform = '';
      this.#progress.removeAttribute('aria-valuenow');
    }
  }

  /** Shows a message over the picture; `null` takes it away. */
  message(text: string | null): void {
    this.#message.hidden = text === null;
    this.#message.textContent = text ?? '';
  }
}

function box(name: string, part?: string): HTMLElement {
  const element = document.createElement('div');
  element.className = name;
  if (part) element.setAttribute('part', part);
  return element;
}
