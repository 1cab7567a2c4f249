/** Importing this defines `<relightable-photo>`, in a browser; on a server it does nothing. */

import { RelightablePhoto } from './element.js';

export type { BlobOptions, PhotoInfo } from './element.js';
export { RelightablePhoto } from './element.js';
export type { Backend } from './engine.js';
export type { EngineErrorCode, ErrorCode, PageErrorCode } from './errors.js';
export { PhotoError } from './errors.js';
export type { RelightablePhotoEventMap } from './events.js';
export {
  BackendChangeEvent,
  ContextLostEvent,
  LightChangeEvent,
  PhotoErrorEvent,
  QualityChangeEvent,
  ViewChangeEvent,
} from './events.js';
export type { LightPose } from './exhibit.js';
export type {
  BrowserPicture,
  LightPicture,
  LightSource,
  LinearLight,
} from './light-source.js';
export type { Reflected } from './reflect.js';
export type { LightName, Loading, PicturePoint, Reveal } from './settings.js';
export { BACKENDS, LIGHTS } from './settings.js';
export type { PhotoView } from './viewport.js';

/** The element's name in HTML. */
export const TAG = 'relightable-photo';

// A page may come to load two copies; the first one stays.
if (globalThis.customElements && !customElements.get(TAG)) {
  customElements.define(TAG, RelightablePhoto);
}
