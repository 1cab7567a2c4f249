/** What a visitor does, by pointer, wheel, keyboard and tilt; and what happens while nobody does anything. */

import { CENTRE, type PicturePoint } from '../shared/values.js';
import type { LightItem } from '../state/lighting.js';
import type { Exhibit } from '../state/viewer-state.js';
import {
  type PhotoView,
  pan,
  toggleZoom,
  toPicture,
  WHOLE,
  ZOOM_STEP,
  zoomAt,
} from '../state/viewport.js';
import type { View } from '../ui/view.js';
import { Frames } from './animation-loop.js';
import type { Allowed } from './gestures.js';
import type { Velocity } from './inertia.js';
import { type Focus, type KeyAction, keyAction } from './keys.js';
import { Movement } from './light-animator.js';
import { Pointing } from './pointer-input.js';
import { Tilting } from './tilt-sensor.js';
import { Idle } from './wander.js';

/** What is told. */
export interface VisitorListener {
  /** Something is another from now on. */
  changed(): void;
  /** The part that is shown is another. */
  looked(): void;
  /** A light was chosen by a key. */
  lightChosen(item: LightItem): void;
  /** Escape. */
  leave(): void;
  /** The page scrolls where somebody may have wanted to zoom. */
  scrolled(by: 'wheel' | 'touch'): void;
  /** Nobody is there any more. */
  expired(): void;
  /** Anything at all was done, by a key or otherwise. */
  touched(byKey: boolean): void;
}

/** See the module. */
export class Visitor {
  readonly #exhibit: Exhibit;
  readonly #listener: VisitorListener;
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

  constructor(root: ShadowRoot, view: View, exhibit: Exhibit, listener: VisitorListener) {
    this.#exhibit = exhibit;
    this.#listener = listener;
    this.#view = view;
    this.#movement = new Movement(exhibit.lighting, this.#frames, () => listener.changed());
    this.#idle = new Idle(later, {
      rested: () => {
        this.#awake = false;
        listener.changed();
      },
      expired: () => listener.expired(),
    });
    this.#tilting = new Tilting((point) => {
      if (!exhibit.lighting.holdsTorch) return;
      this.touch();
      this.#shineAt(point);
    });
    this.#pointing = new Pointing(view.stage, {
      allowed: () => this.#allowed,
      isCooperative: () => exhibit.asked.cooperative,
      wheel: (factor, at) => this.#look(zoomAt(exhibit.view, factor, at, exhibit.asked.zoom)),
      scrolled: (by) => listener.scrolled(by),
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
        listener.changed();
      },
      throwLight: (velocity) => this.#throw(velocity),
      pan: (dx, dy) => {
        const moved = this.#inBox(dx, dy);
        this.#look(pan(exhibit.view, moved.x, moved.y, exhibit.asked.zoom));
      },
      zoom: (factor, x, y) => {
        this.#look(zoomAt(exhibit.view, factor, this.#inBox(x, y), exhibit.asked.zoom));
      },
      tapTwice: (x, y) => {
        this.#look(toggleZoom(exhibit.view, this.#inBox(x, y), exhibit.asked.zoom));
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
      listener.changed();
    };
    view.handle.addEventListener('focus', focus);
    view.handle.addEventListener('blur', focus);
  }

  /** Begins and ends what moves by itself. */
  update(plays: boolean): void {
    const { lighting, shown, asked, curtain } = this.#exhibit;
    this.#idle.kiosk = asked.kiosk;
    this.#frames.allow(curtain.seen);
    const free = !this.#awake && !this.#focused && !this.#tilting.on;
    this.#movement.update({
      fire: plays && shown && lighting.burns,
      breath: plays && shown && asked.breathes && lighting.holdsTorch && free,
    });
  }

  /** Somebody does something. */
  touch(byKey = false): void {
    this.#awake = true;
    this.#idle.touch();
    this.#listener.touched(byKey);
  }

  get tilts(): boolean {
    return this.#tilting.on;
  }

  async tilt(): Promise<boolean> {
    const may = await this.#tilting.request();
    this.#listener.changed();
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
    const { view, asked } = this.#exhibit;
    this.#look(zoomAt(view, ZOOM_STEP ** by, CENTRE, asked.zoom));
  }

  stop(): void {
    this.reset();
    this.#idle.stop();
    this.#frames.clear();
  }

  get #allowed(): Allowed {
    const { lighting, asked, shown, view } = this.#exhibit;
    return {
      light: shown && lighting.holdsTorch,
      zoom: shown && asked.zoom > 1,
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
    this.#listener.changed();
  }

  #throw({ x, y }: Velocity): void {
    if (matchMedia('(prefers-reduced-motion: reduce)').matches) return;
    const { zoom } = this.#exhibit.view;
    const inBox = this.#inBox(x, y);
    this.#movement.throw({ x: inBox.x / zoom, y: inBox.y / zoom });
  }

  /** Gives whether that is something else than before. */
  #look(view: PhotoView): boolean {
    const before = this.#exhibit.view;
    this.#exhibit.view = view;
    const other = this.#exhibit.view !== before;
    if (other) this.#listener.looked();
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
    const { lighting, view, asked } = this.#exhibit;
    const at = lighting.torch ?? CENTRE;
    switch (action.kind) {
      case 'move':
        this.#shineAt({ x: at.x + action.dx, y: at.y + action.dy });
        return true;
      case 'jump':
        this.#shineAt({ x: action.x, y: at.y });
        return true;
      case 'pan':
        return this.#look(pan(view, action.dx, action.dy, asked.zoom));
      case 'zoom':
        if (asked.zoom > 1) this.zoom(action.by);
        return asked.zoom > 1;
      case 'whole':
        return this.#look(WHOLE);
      case 'light':
        this.#listener.lightChosen(this.#exhibit.step(action.by));
        return true;
      case 'leave':
        this.#listener.leave();
        return false;
    }
  }
}

function later(ms: number, callback: () => void): () => void {
  const timer = setTimeout(callback, ms);
  return () => clearTimeout(timer);
}
