/** Images, videos, cameras and numbers as light: a separate script, which has its own copies of shared code. */

export { LightMedia } from './light-media.js';
export { LightSourceObserver } from './light-source-observer.js';
