/** What a visitor does, by pointer, wheel, keyboard and tilt; and what happens while nobody does anything. */

import { Frames } from './frames.js';
import type { Allowed } from './gestures.js';
import { Idle } from './idle.js';
import type { Velocity } from './inertia.js';
import { type Focus, type KeyAction, keyAction } from './keys.js';
import type { Lighting } from './lighting.js';
import { Movement } from './movement.js';
import { Pointing } from './pointing.js';
import { CENTRE, type PicturePoint } from './settings.js';
import { Tilting } from './tilting.js';
import type { View } from './view.js';
import {
  type PhotoView,
  pan,
  sameView,
  toggleZoom,
  toPicture,
  WHOLE,
  ZOOM_STEP,
  zoomAt,
} from './viewport.js';

/** What visitors have before them. */
export interface Exhibit {
  readonly lighting: Lighting;
  /** The part of the picture that is shown. */
  view: PhotoView;
  /** The furthest magnification. */
  readonly mostZoom: number;
  readonly cooperative: boolean;
  /** Whether there is a picture to be seen. */
  readonly shown: boolean;
  /** Whether things may move by themselves, and whether the torch is to. */
  readonly plays: boolean;
  readonly breathes: boolean;
  /** Something is another from now on. */
  changed(): void;
  /** A light was chosen by a key. */
  lightChosen(): void;
  /** Escape. */
  leave(): void;
  hint(by: 'wheel' | 'touch'): void;
  /** Nobody is there any more. */
  expired(): void;
  /** Anything at all was done, by a key or otherwise. */
  touched(byKey: boolean): void;
}

/** See the module. */
export class Visitor {
  readonly #exhibit: Exhibit;
  readonly #view: View;
  readonly #pointing: Pointing;
  readonly #tilting: Tilting;
  readonly #frames = new Frames(requestAnimationFrame.bind(globalThis));
  readonly #movement: Movement;
  readonly #idle: Idle;
  /** Somebody has done something of late, or has the light's focus. */
  #awake = false;
  #focused = false;
  /** Where the torch was before a drag. */
  #torch: PicturePoint | null = null;

  constructor(root: ShadowRoot, view: View, exhibit: Exhibit) {
    this.#exhibit = exhibit;
    this.#view = view;
    this.#movement = new Movement(exhibit.lighting, this.#frames, () => exhibit.changed());
    this.#idle = new Idle(later, {
      rested: () => {
        this.#awake = false;
        exhibit.changed();
      },
      expired: () => exhibit.expired(),
    });
    this.#tilting = new Tilting((point) => {
      if (!exhibit.lighting.holdsTorch) return;
      this.touch();
      this.#shineAt(point);
    });
    this.#pointing = new Pointing(view.stage, {
      allowed: () => this.#allowed,
      isCooperative: () => exhibit.cooperative,
      wheel: (factor, at) => this.#look(zoomAt(exhibit.view, factor, at, exhibit.mostZoom)),
      scrolled: (by) => exhibit.hint(by),
      touched: () => this.touch(),
      pressed: () => {
        const { handle, stage } = view;
        (handle.hidden ? stage : handle).focus({ preventScroll: true });
      },
      light: (x, y) => {
        this.#torch = exhibit.lighting.torch;
        this.#shineAt(toPicture(exhibit.view, this.#inBox(x, y)));
      },
      undoLight: () => {
        exhibit.lighting.torch = this.#torch;
        exhibit.changed();
      },
      throwLight: (velocity) => this.#throw(velocity),
      pan: (dx, dy) => {
        const moved = this.#inBox(dx, dy);
        this.#look(pan(exhibit.view, moved.x, moved.y, exhibit.mostZoom));
      },
      zoom: (factor, x, y) => {
        this.#look(zoomAt(exhibit.view, factor, this.#inBox(x, y), exhibit.mostZoom));
      },
      tapTwice: (x, y) => {
        this.#look(toggleZoom(exhibit.view, this.#inBox(x, y), exhibit.mostZoom));
      },
    });
    root.addEventListener('keydown', (event) => this.#press(event as KeyboardEvent));
    root.addEventListener('keyup', (event) => {
      if ((event as KeyboardEvent).key === ' ') this.#pointing.pans = false;
    });
    // A light that is read out stays where it is. Pressing the picture focuses it as well.
    const focus = () => {
      this.#focused = view.handle.matches(':focus-visible');
      this.#pointing.pans = false;
      exhibit.changed();
    };
    view.handle.addEventListener('focus', focus);
    view.handle.addEventListener('blur', focus);
  }

  /** Begins and ends what moves by itself. */
  update(watched: boolean, kiosk: number): void {
    const { lighting, plays, breathes, shown } = this.#exhibit;
    this.#idle.kiosk = kiosk;
    this.#frames.allow(watched);
    const free = !this.#awake && !this.#focused && !this.#tilting.on;
    this.#movement.update({
      fire: plays && shown && lighting.burns,
      breath: plays && shown && breathes && lighting.holdsTorch && free,
    });
  }

  /** Somebody does something. */
  touch(byKey = false): void {
    this.#awake = true;
    this.#idle.touch();
    this.#exhibit.touched(byKey);
  }

  get tilts(): boolean {
    return this.#tilting.on;
  }

  async tilt(): Promise<boolean> {
    const may = await this.#tilting.request();
    this.#exhibit.changed();
    return may;
  }

  /** Puts down all that a visitor holds. */
  reset(): void {
    this.#tilting.stop();
    this.#movement.hold();
    this.#awake = false;
  }

  /** Magnifies around the middle. */
  zoom(by: 1 | -1): void {
    const { view, mostZoom } = this.#exhibit;
    this.#look(zoomAt(view, ZOOM_STEP ** by, CENTRE, mostZoom));
  }

  stop(): void {
    this.reset();
    this.#idle.stop();
    this.#frames.clear();
  }

  get #allowed(): Allowed {
    const { lighting, mostZoom, shown, view } = this.#exhibit;
    return {
      light: shown && lighting.holdsTorch,
      zoom: shown && mostZoom > 1,
      zoomed: view.zoom > 1,
    };
  }

  #inBox(x: number, y: number): PicturePoint {
    const { width, height } = this.#pointing.size;
    return { x: x / Math.max(1, width), y: y / Math.max(1, height) };
  }

  #shineAt(point: PicturePoint): void {
    this.#movement.hold();
    this.#exhibit.lighting.torch = point;
    this.#exhibit.changed();
  }

  #throw({ x, y }: Velocity): void {
    if (matchMedia('(prefers-reduced-motion: reduce)').matches) return;
    const { zoom } = this.#exhibit.view;
    const inBox = this.#inBox(x, y);
    this.#movement.throw({ x: inBox.x / zoom, y: inBox.y / zoom });
  }

  /** Gives whether that is something else than before. */
  #look(view: PhotoView): boolean {
    const other = !sameView(view, this.#exhibit.view);
    this.#exhibit.view = view;
    return other;
  }

  #press(event: KeyboardEvent): void {
    const focus = this.#focusOf(event.target);
    if (!focus) return;
    this.touch(true);
    if (event.key === ' ' && focus !== 'controls') {
      this.#pointing.pans = true;
      event.preventDefault();
      return;
    }
    const action = keyAction(event, focus);
    if (action && this.#do(action)) event.preventDefault();
  }

  #focusOf(target: EventTarget | null): Focus | null {
    if (target === this.#view.handle) return 'light';
    if (target === this.#view.stage) return 'picture';
    const inControls =
      target instanceof Element && target.closest('[role=toolbar], [role=radiogroup]');
    return inControls ? 'controls' : null;
  }

  /** Gives whether that was the element's business. */
  #do(action: KeyAction): boolean {
    const { lighting, view, mostZoom } = this.#exhibit;
    const at = lighting.torch ?? CENTRE;
    switch (action.kind) {
      case 'move':
        this.#shineAt({ x: at.x + action.dx, y: at.y + action.dy });
        return true;
      case 'jump':
        this.#shineAt({ x: action.x, y: at.y });
        return true;
      case 'pan':
        return this.#look(pan(view, action.dx, action.dy, mostZoom));
      case 'zoom':
        if (mostZoom > 1) this.zoom(action.by);
        return mostZoom > 1;
      case 'whole':
        return this.#look(WHOLE);
      case 'light': {
        const { items } = lighting;
        const next = items.indexOf(lighting.item) + action.by;
        lighting.item = items.at(next % items.length) ?? lighting.item;
        this.#exhibit.lightChosen();
        return true;
      }
      case 'leave':
        this.#exhibit.leave();
        return false;
    }
  }
}

function later(ms: number, callback: () => void): () => void {
  const timer = setTimeout(callback, ms);
  return () => clearTimeout(timer);
}
