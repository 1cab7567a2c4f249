/** Importing this module defines `<relightable-photo>` in a browser. On a server it has no effect. */

import { defineRelightablePhoto } from './element/define.js';

export * from './element-entry.js';

defineRelightablePhoto();
