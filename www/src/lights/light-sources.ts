/**
 * Support for images, videos, cameras and numbers as light. The element fetches this script only when a page uses
 * such a light; the script contains its own copies of the modules that it shares with the element.
 */

export { LightMedia } from './light-media.js';
export { LightSourceObserver } from './light-source-observer.js';
