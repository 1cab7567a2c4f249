/** The element's class and all that goes with it. Importing this has no side effects. */

export { defineRelightablePhoto, TAG } from './define.js';
export type { BlobOptions, PhotoInfo } from './element.js';
export { RelightablePhoto } from './element.js';
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
export type { Backend, Gamut, LightName, ToneCurve } from './names.js';
export type { Reflected } from './reflect.js';
export type { Loading, PicturePoint, Reveal } from './settings.js';
export { BACKENDS, LIGHTS } from './settings.js';
export type { PhotoView } from './viewport.js';
