/**
 * Pictures, films, cameras and numbers as light. A script of its own, as most pages do with the built-in lights.
 * It has copies of what it shares with the element's.
 */

export { LightMedia } from './light-media.js';
export { LightFollower } from './light-source-observer.js';
