/** The element's class, its events and its types. Importing this module has no side effects. */

export { defineRelightablePhoto, TAG } from './element/define.js';
export {
  type PhotoInfo,
  RelightablePhotoElement,
  type StateOptions,
  type ToBlobOptions,
} from './element/element.js';
export {
  BackendChangeEvent,
  ContextLostEvent,
  LightChangeEvent,
  PhotoErrorEvent,
  PhotoWarningEvent,
  QualityChangeEvent,
  type RelightablePhotoEventMap,
  ViewChangeEvent,
} from './element/events.js';
export type { ReflectedProperties } from './element/reflect.js';
export type { StringKey as TranslationKey, Translation } from './i18n/translations.js';
export type { TransitionOptions } from './input/transitions.js';
export type {
  BrowserImageSource,
  LightImageSource,
  LightSource,
  LinearImage,
} from './lights/light-source.js';
export type { PhotographSource, TransferredPhoto } from './photo/types.js';
export type { ErrorCode } from './shared/error-codes.js';
export { PhotoError } from './shared/errors.js';
export type { Backend, Gamut, LightName, ToneCurve } from './shared/keywords.js';
export { BACKENDS, LIGHTS } from './shared/keywords.js';
export type { PicturePoint } from './shared/value-types.js';
export type { LoadingMode, RevealMode } from './state/attribute-parsers.js';
export type { LightOptions, LightValue } from './state/page-light.js';
export type { PictureRect, ViewChange, ZoomView } from './state/viewport.js';
