/** The element's events. As those of `<img>` and `<video>` they do not bubble, and none can be cancelled. */

import type { LightSource } from '../lights/light-source.js';
import type { ErrorCode, PhotoError } from '../shared/errors.js';
import type { Backend, LightName } from '../shared/keywords.js';
import type { PicturePoint } from '../shared/value-types.js';
import type { ZoomView } from '../state/viewport.js';

/** An event with further fields. */
class BaseElementEvent extends Event {
  constructor(type: string, fields: object) {
    super(type);
    Object.assign(this, fields);
  }
}

/** An event with the fields of an error. */
class FaultEvent extends BaseElementEvent {
  /** Identifies the fault for programs. */
  declare readonly code: ErrorCode;
  /** Explains the fault to people. */
  declare readonly message: string;
  /** The underlying error, if any. */
  declare readonly cause: unknown;

  constructor(type: string, { code, message, cause }: PhotoError) {
    super(type, { code, message, cause });
  }
}

/** `error`: there is no picture. The element shows the message as well. */
export class PhotoErrorEvent extends FaultEvent {
  constructor(error: PhotoError) {
    super('error', error);
  }
}

/** `warning`: something else does not work as requested. The console has the message as well, the picture does not. */
export class PhotoWarningEvent extends FaultEvent {
  constructor(error: PhotoError) {
    super('warning', error);
  }
}

/** `lightchange`: another light is active, or the torch has moved. New frames of a source are no change. */
export class LightChangeEvent extends BaseElementEvent {
  /** The built-in light, or the one that the source replaces. */
  declare readonly light: LightName;
  /** The torch's position; `null` behind the centre, and for other lights. */
  declare readonly torch: PicturePoint | null;
  /** The source that replaces the built-in light, if any. */
  declare readonly source: LightSource | null;

  constructor(light: LightName, torch: PicturePoint | null, source: LightSource | null) {
    super('lightchange', { light, torch, source });
  }
}

/** `backendchange`: a backend is in use, the first one or another one. */
export class BackendChangeEvent extends BaseElementEvent {
  declare readonly backend: Backend;
  /** The backend before it, `null` for the first. */
  declare readonly previous: Backend | null;
  /** Why preferred backends are not in use, and why rendering is degraded; empty if neither applies. */
  declare readonly reason: string;

  constructor(backend: Backend, previous: Backend | null, reason: string) {
    super('backendchange', { backend, previous, reason });
  }
}

/** `qualitychange`: another share of the components is drawn, below 1 while the file loads or the picture changes fast. */
export class QualityChangeEvent extends BaseElementEvent {
  /** 0 to 1. */
  declare readonly quality: number;

  constructor(quality: number) {
    super('qualitychange', { quality });
  }
}

/** `contextlost`: the backend in use was lost; `backendchange` reports its replacement. */
export class ContextLostEvent extends BaseElementEvent {
  declare readonly backend: Backend;
  /** The browser's explanation. */
  declare readonly message: string;

  constructor(backend: Backend, message: string) {
    super('contextlost', { backend, message });
  }
}

/** `viewchange`: another part of the picture is visible. */
export class ViewChangeEvent extends BaseElementEvent {
  /** Magnification; 1 shows the whole picture. */
  declare readonly zoom: number;
  /** The point of the picture at the centre of the element, 0 to 1. */
  declare readonly x: number;
  declare readonly y: number;

  constructor({ zoom, x, y }: ZoomView) {
    super('viewchange', { zoom, x, y });
  }
}

/** Events by name, for typed listeners. */
export interface RelightablePhotoEventMap
  extends Omit<HTMLElementEventMap, 'error' | 'contextlost'> {
  load: Event;
  progress: ProgressEvent<HTMLElement>;
  error: PhotoErrorEvent;
  warning: PhotoWarningEvent;
  lightchange: LightChangeEvent;
  backendchange: BackendChangeEvent;
  qualitychange: QualityChangeEvent;
  viewchange: ViewChangeEvent;
  contextlost: ContextLostEvent;
}
