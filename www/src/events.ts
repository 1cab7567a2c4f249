/** The element's events. All bubble and cross shadow boundaries; none can be cancelled. */

import type { Backend } from './engine.js';
import type { ErrorCode, PhotoError } from './errors.js';
import type { LightSource } from './light-source.js';
import type { LightName, PicturePoint } from './settings.js';
import type { PhotoView } from './viewport.js';

const TRAVELS: EventInit = { bubbles: true, composed: true };

/** `load`: the photograph is there and drawn. */
export function loadEvent(): Event {
  return new Event('load', TRAVELS);
}

/** `progress`: more of the file has come; `total` is 0 until known. */
export function progressEvent(loaded: number, total: number): ProgressEvent {
  return new ProgressEvent('progress', { ...TRAVELS, loaded, total, lengthComputable: total > 0 });
}

/** `error`: something failed; the same message stands inside the element. */
export class PhotoErrorEvent extends Event {
  /** For programs. */
  readonly code: ErrorCode;
  /** For people. */
  readonly message: string;
  /** What was caught, where there was something. */
  readonly cause: unknown;

  constructor(error: PhotoError) {
    super('error', TRAVELS);
    this.code = error.code;
    this.message = error.message;
    this.cause = error.cause;
  }
}

/** `lightchange`: the light is another, or the torch has moved. Frames of one source do not tell. */
export class LightChangeEvent extends Event {
  /** The built-in light; where there is a source, the one that it stands in for. */
  readonly light: LightName;
  /** Where a torch that was moved shines; `null` for one in the middle, and for other lights. */
  readonly torch: PicturePoint | null;
  /** What shines in the built-in light's place; `null` where that one does. */
  readonly source: LightSource | null;

  constructor(light: LightName, torch: PicturePoint | null, source: LightSource | null) {
    super('lightchange', TRAVELS);
    this.light = light;
    this.torch = torch;
    this.source = source;
  }
}

/** `backendchange`: a back end was taken up, the first one too. */
export class BackendChangeEvent extends Event {
  readonly backend: Backend;
  /** The one it replaces, `null` for the first. */
  readonly previous: Backend | null;
  /**
   * Why not the one before it or those preferred to it, and why it is slower than it could be; empty where
   * there is nothing to say.
   */
  readonly reason: string;

  constructor(backend: Backend, previous: Backend | null, reason: string) {
    super('backendchange', TRAVELS);
    this.backend = backend;
    this.previous = previous;
    this.reason = reason;
  }
}

/**
 * `qualitychange`: what is shown is drawn by another share of the photograph than before. It is less than
 * 1 only while the picture moves faster than all of it can be drawn.
 */
export class QualityChangeEvent extends Event {
  /** 0 to 1, in full detail; the first picture is. */
  readonly share: number;

  constructor(share: number) {
    super('qualitychange', TRAVELS);
    this.share = share;
  }
}

/** `contextlost`: the back end that drew is gone; `backendchange` tells what takes its place. */
export class ContextLostEvent extends Event {
  readonly backend: Backend;
  /** What the browser says of it. */
  readonly message: string;

  constructor(backend: Backend, message: string) {
    super('contextlost', TRAVELS);
    this.backend = backend;
    this.message = message;
  }
}

/** `viewchange`: another part of the picture is shown. */
export class ViewChangeEvent extends Event {
  /** Magnification; 1 shows all of the picture. */
  readonly zoom: number;
  /** The point of the picture in the middle, from 0 to 1. */
  readonly x: number;
  readonly y: number;

  constructor({ zoom, x, y }: PhotoView) {
    super('viewchange', TRAVELS);
    this.zoom = zoom;
    this.x = x;
    this.y = y;
  }
}

/** Events by name, for typed listeners. */
export interface RelightablePhotoEventMap
  extends Omit<HTMLElementEventMap, 'error' | 'contextlost'> {
  load: Event;
  progress: ProgressEvent<HTMLElement>;
  error: PhotoErrorEvent;
  lightchange: LightChangeEvent;
  backendchange: BackendChangeEvent;
  qualitychange: QualityChangeEvent;
  viewchange: ViewChangeEvent;
  contextlost: ContextLostEvent;
}
