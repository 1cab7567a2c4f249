/** Configuration of the analyser that makes the custom elements manifest. */

import { elementPlugin } from './manifest-plugin.js';

export default {
  globs: ['www/src/element/element.ts', 'www/src/element/events.ts', 'www/src/element/reflect.ts'],
  // No entry in package.json, which has it.
  packagejson: false,
  plugins: [elementPlugin()],
};
