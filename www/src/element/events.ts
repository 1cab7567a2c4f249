/** The element's events. All bubble and cross shadow boundaries; none can be cancelled. */

import type { Backend } from '../engine/types.js';
import type { LightSource } from '../lights/light-source.js';
import type { ErrorCode, PhotoError } from '../shared/errors.js';
import type { LightName } from '../shared/names.js';
import type { PicturePoint } from '../shared/values.js';
import type { PhotoView } from '../state/viewport.js';

const TRAVELS: EventInit = { bubbles: true, composed: true };

/** What happened, and what is told of it. */
class PhotoEvent extends Event {
  constructor(type: string, told: object) {
    super(type, TRAVELS);
    Object.assign(this, told);
  }
}

/** `load`: the photograph is there and drawn. */
export function loadEvent(): Event {
  return new Event('load', TRAVELS);
}

/** `progress`: more of the file has come; `total` is 0 until known. */
export function progressEvent(loaded: number, total: number): ProgressEvent {
  return new ProgressEvent('progress', { ...TRAVELS, loaded, total, lengthComputable: total > 0 });
}

/** `error`: something failed; the same message stands inside the element. */
export class PhotoErrorEvent extends PhotoEvent {
  /** For programs. */
  declare readonly code: ErrorCode;
  /** For people. */
  declare readonly message: string;
  /** What was caught, where there was something. */
  declare readonly cause: unknown;

  constructor({ code, message, cause }: PhotoError) {
    super('error', { code, message, cause });
  }
}

/** `lightchange`: the light is another, or the torch has moved. Frames of one source do not tell. */
export class LightChangeEvent extends PhotoEvent {
  /** The built-in light; where there is a source, the one that it stands in for. */
  declare readonly light: LightName;
  /** Where a torch that was moved shines; `null` for one in the middle, and for other lights. */
  declare readonly torch: PicturePoint | null;
  /** What shines in the built-in light's place; `null` where that one does. */
  declare readonly source: LightSource | null;

  constructor(light: LightName, torch: PicturePoint | null, source: LightSource | null) {
    super('lightchange', { light, torch, source });
  }
}

/** `backendchange`: a back end was taken up, the first one too. */
export class BackendChangeEvent extends PhotoEvent {
  declare readonly backend: Backend;
  /** The one it replaces, `null` for the first. */
  declare readonly previous: Backend | null;
  /**
   * Why not the one before it or those preferred to it, and why it is slower than it could be; empty where
   * there is nothing to say.
   */
  declare readonly reason: string;

  constructor(backend: Backend, previous: Backend | null, reason: string) {
    super('backendchange', { backend, previous, reason });
  }
}

/**
 * `qualitychange`: what is shown is drawn by another share of the photograph than before. It is less than
 * 1 only while the picture moves faster than all of it can be drawn.
 */
export class QualityChangeEvent extends PhotoEvent {
  /** 0 to 1, in full detail; the first picture is. */
  declare readonly share: number;

  constructor(share: number) {
    super('qualitychange', { share });
  }
}

/** `contextlost`: the back end that drew is gone; `backendchange` tells what takes its place. */
export class ContextLostEvent extends PhotoEvent {
  declare readonly backend: Backend;
  /** What the browser says of it. */
  declare readonly message: string;

  constructor(backend: Backend, message: string) {
    super('contextlost', { backend, message });
  }
}

/** `viewchange`: another part of the picture is shown. */
export class ViewChangeEvent extends PhotoEvent {
  /** Magnification; 1 shows all of the picture. */
  declare readonly zoom: number;
  /** The point of the picture in the middle, from 0 to 1. */
  declare readonly x: number;
  declare readonly y: number;

  constructor({ zoom, x, y }: PhotoView) {
    super('viewchange', { zoom, x, y });
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
