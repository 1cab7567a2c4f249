/** Runs once before all browser tests. */

import { makeTestPhotos } from './test-photos.js';

export default makeTestPhotos;
