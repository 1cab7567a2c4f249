/** Importing this defines `<relightable-photo>`, in a browser; on a server it does nothing. */

import { defineRelightablePhoto } from './element/define.js';

export * from './element-entry.js';

defineRelightablePhoto();
